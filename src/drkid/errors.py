"""What can go wrong, named. Every error says what was wrong, what was wanted, what was found and what to try."""


class DrkidError(Exception):
    """Base of the errors that a user can do something about; the command line exits with `exit_status`."""

    exit_status = 2

    def __init__(self, problem: str, *, wanted: str = "", found: str = "", remedy: str = "") -> None:
        """Keep the parts apart, so that a front door can lay them out; `str()` joins them."""
        self.problem, self.wanted, self.found, self.remedy = problem, wanted, found, remedy
        super().__init__(problem)

    def __str__(self) -> str:
        """One paragraph: problem; wanted; found; try."""
        parts = [self.problem]
        parts += [f"wanted: {self.wanted}"] if self.wanted else []
        parts += [f"found: {self.found}"] if self.found else []
        parts += [f"try: {self.remedy}"] if self.remedy else []
        return "; ".join(parts)


class SpecError(DrkidError):
    """A parameter, or a combination of parameters, that cannot be met."""


class InputError(DrkidError):
    """A file that cannot be read, or that holds nothing a kit can be made of."""


class RemeshError(DrkidError):
    """No closed manifold mesh of the wanted size and genus was found on this surface."""


class FitError(DrkidError):
    """Pockets, hinges or walls that do not fit into the pieces."""


class KitFolderError(DrkidError):
    """A kit folder that cannot be written or read."""
