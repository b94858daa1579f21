"""One colour per class, told apart by colour-blind eyes too."""

# Paul Tol's "muted" scheme, then his "light" one (SRON technical note, 2021).
COLOURS = (
    "#332288", "#88CCEE", "#44AA99", "#117733", "#999933", "#DDCC77", "#CC6677", "#882255", "#AA4499",
    "#77AADD", "#99DDFF", "#BBCC33", "#AAAA00", "#EEDD88", "#EE8866", "#FFAABB",
)  # fmt: skip
CONNECTOR_COLOUR = "#BBBBBB"


def class_colour(index: int) -> str:
    """Colour of a class as #RRGGBB; they repeat after sixteen classes."""
    return COLOURS[index % len(COLOURS)]
