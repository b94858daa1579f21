"""Order of building for merged pieces, on the graph of pieces instead of faces."""

from drkid.kit import Joint, Piece, Step


def merged_steps(pieces: tuple[Piece, ...], joints: tuple[Joint, ...]) -> tuple[Step, ...]:
    """Every piece once, each after the first beside one that stands; `joins` are all its neighbours that stand.

    Pieces are named by their first face. The last is the piece whose least convex joint is the most convex, so that
    it goes in along its normal; the first is beside none of its neighbours where there is such a piece. Next comes
    the piece with the most joints to what stands.
    """
    owner = {face: number for number, piece in enumerate(pieces) for face in piece.faces}
    beside: list[dict[int, int]] = [{} for _ in pieces]
    sharpest = [0.0] * len(pieces)
    for joint in joints:
        a, b = (owner[face] for face in joint.faces)
        for one, other in ((a, b), (b, a)):
            beside[one][other] = beside[one].get(other, 0) + 1
            sharpest[one] = max(sharpest[one], joint.dihedral_degrees)
    last = min(range(len(pieces)), key=lambda p: (sharpest[p], p))
    near = {last, *beside[last]}
    first = min(range(len(pieces)), key=lambda p: (p in near, p == last, p))
    order, standing = [first], {first}
    while len(order) < len(pieces):
        waiting = {n for p in standing for n in beside[p]} - standing
        order.append(min(waiting, key=lambda p: (p == last, -sum(k for n, k in beside[p].items() if n in standing), p)))
        standing.add(order[-1])
    rank = {piece: i for i, piece in enumerate(order)}
    return tuple(
        Step(pieces[p].face, tuple(sorted(pieces[n].face for n in beside[p] if rank[n] < rank[p]))) for p in order
    )
