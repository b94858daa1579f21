"""coupon.stl."""

from drkid.export.layout import COUPON
from drkid.export.stl import stl_bytes
from drkid.kit import Kit
from drkid.mesh import rounded


def coupon_files(kit: Kit) -> dict[str, bytes]:
    """The fit coupon as it lies on the bed; none where the kit has no connector."""
    body = kit.part_set.coupon
    return {} if body is None else {COUPON: stl_bytes(rounded(body.mesh()))}
