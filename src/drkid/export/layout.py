"""Where everything lies in a kit folder: the only place that knows a file's name."""

KIT_JSON = "kit.json"
SURFACE = "surface.ply"
SIMPLIFIED = "simplified.ply"
ASSEMBLED = "assembled.ply"
PARTS = "parts"
PICTURES = "pictures"
BOM_CSV = "bom.csv"
BOM_JSON = "bom.json"
PIECE_CLASS = "piece_class"  # face property of ASSEMBLED

# Reserved for the documents that people hold and print.
PLATES = "plates"
NET_SVG, NET_PDF = "net.svg", "net.pdf"
GUIDE_HTML, GUIDE_PDF = "guide.html", "guide.pdf"
REPORT = "report.html"
COUPON = "coupon.stl"


def part_file(name: str, handedness: str) -> str:
    """File of a class's part: the class's name, and the part's hand where hands differ."""
    hand = "" if handedness == "any" else f"_{handedness}"
    return f"{PARTS}/{name}{hand}.stl"


def connector_file(name: str) -> str:
    """File of a connector part."""
    return f"{PARTS}/{name}.stl"


def part_label(file: str) -> str:
    """What people call the part of a file: A, A2, A left, connector half."""
    return file.rsplit("/", 1)[-1].removesuffix(".stl").replace("_", " ")


def picture_file(file: str) -> str:
    """Picture of the part of a file."""
    return f"{PICTURES}/{file.rsplit('/', 1)[-1].removesuffix('.stl')}.png"


def plate_file(number: int) -> str:
    """File of a build plate, counted from 1."""
    return f"{PLATES}/plate_{number:02d}.3mf"
