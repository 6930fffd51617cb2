"""The numbers that steer the skeleton of a cloud: constants, weights and defaults, and where each comes from."""

import ast
import dataclasses
import re
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "glsk_o3d"
ROOMS = ("geometry", "curve")
FILES = (
    "data/points",
    *(f"filters/{name}" for name in ("sampler", "outlier_remover", "denoiser", "thinner", "ring_builder")),
    *(f"filters/{name}" for name in ("contractor", "lpr_reducer", "stopping", "connector", "refiner", "tracer")),
    "data/decisions",
)
ORIGINS = ("published", "derived", "measured", "fitted", "speed", "precision", "warning")
"""Where numbers come from. Those for speed, such as the sizes of blocks, change no result; those of precision change
none if they are finer; those of warnings change only warnings."""
ORIGIN = re.compile(rf"\b({'|'.join(ORIGINS)})\b", re.IGNORECASE)


@dataclasses.dataclass(frozen=True)
class Number:
    """A constant or the default of an option."""

    place: str
    """Its file, without ending, or the class that it is an option of."""
    name: str
    value: str
    origin: str
    what: str

    @property
    def steers(self):
        """Whether the number was chosen, and another value would give another skeleton."""
        return self.origin in ("published", "measured", "fitted")


def constants(tree):
    """The upper-case names that a module assigns, each with its statement."""
    for statement in tree.body:
        if isinstance(statement, (ast.Assign, ast.AnnAssign)):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            for node in (node for target in targets for node in ast.walk(target)):
                if isinstance(node, ast.Name) and node.id.isupper():
                    yield node.id, statement


def is_number(value):
    """Whether an expression is made of plain numbers: one, a tuple of them, or arithmetic."""
    if isinstance(value, (ast.Tuple, ast.List)):
        return bool(value.elts) and all(map(is_number, value.elts))
    if isinstance(value, ast.BinOp):
        return is_number(value.left) and is_number(value.right)
    if isinstance(value, ast.UnaryOp):
        return is_number(value.operand)
    return ast.unparse(value) == "np.pi" or (isinstance(value, ast.Constant) and type(value.value) in (int, float))


def comments(lines, statement):
    """The comments of a statement: above the group that it is in, directly above it, and at its end."""
    first, end = statement.lineno - 1, statement.end_lineno
    top = first
    while top and lines[top - 1].strip():
        top -= 1
    group = next((row for row in range(top, first) if not lines[row].startswith("#")), first)
    own = next((row + 1 for row in range(first - 1, top - 1, -1) if not lines[row].startswith("#")), top)
    return [*lines[top:group], *lines[own:first], lines[end - 1].partition("#")[2]]


def origin(lines):
    """Where a number comes from by its comments, the nearest first; None if they do not name it."""
    return next((match[1].lower() for line in reversed(lines) if (match := ORIGIN.search(line))), None)


def files():
    """The modules with such numbers, those of the filters first."""
    return [
        *(PACKAGE / f"{name}.py" for name in FILES),
        *(p for room in ROOMS for p in sorted((PACKAGE / room).rglob("*.py"))),
    ]


def all_constants():
    """Every constant of the filters and of the modules that they call, as a list of Number."""
    numbers = []
    for path in files():
        text = path.read_text(encoding="utf-8")
        for name, statement in constants(ast.parse(text)):
            if is_number(statement.value):
                lines = comments(text.splitlines(), statement)
                what = " ".join(line.strip(" #") for line in lines).strip()
                place = path.relative_to(PACKAGE).with_suffix("").as_posix()
                numbers.append(Number(place, name, value_of(name, statement), origin(lines) or "", what))
    return numbers


def value_of(name, statement):
    """The value that a statement assigns to one of its names, as it is written."""
    target = statement.targets[0] if isinstance(statement, ast.Assign) else statement.target
    if isinstance(target, ast.Tuple) and isinstance(statement.value, ast.Tuple):
        return ast.unparse(statement.value.elts[[node.id for node in target.elts].index(name)])
    return ast.unparse(statement.value)


def all_fields():
    """Every number of a step, a field of its dataclass, as a list of Number."""
    numbers = []
    for path in files():
        text = path.read_text(encoding="utf-8")
        place = path.relative_to(PACKAGE).with_suffix("").as_posix()
        for owner in (node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)):
            for field in owner.body:
                call = getattr(field, "value", None)
                if isinstance(field, ast.AnnAssign) and getattr(getattr(call, "func", None), "id", None) in ORIGINS:
                    value, what = call.args
                    written = ast.get_source_segment(text, value)
                    numbers.append(Number(place, field.target.id, written, call.func.id, what.value))
    return numbers


def weights():
    """The weights of the four questions."""
    from glsk_o3d.data.decisions import WORDS
    from glsk_o3d.filters.refiner import QUESTIONS

    found = []
    for question in dict.fromkeys(QUESTIONS):
        place = question.__module__.removeprefix("glsk_o3d.").replace(".", "/")
        what = f"whether {WORDS[question.about].asks.replace(' at ({})', '')}"
        for fact, weight in question.weights.items():
            found.append(Number(place, f"{question.about}: {fact}", f"{weight:g}", "fitted", what))
    return found


def defaults():
    """The numbers that are defaults of options in `default`."""
    from glsk_o3d import pipelines
    from glsk_o3d.data.decisions import WORDS
    from glsk_o3d.pipeline import parts

    thresholds = {words.option for words in WORDS.values()}  # options that are probabilities
    published = {
        (type(part), field): value for part in parts(pipelines.wen2024()) for field, value in vars(part).items()
    }
    found = []
    for part in parts(pipelines.default()):
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            if re.fullmatch(r"[\d.e+-]+%?", str(value)) and type(value) is not bool:
                where = "published" if published.get((type(part), field.name)) == value else "fitted"
                if field.name in thresholds and value == 0.5:
                    where = "derived"  # where both answers are equally likely
                found.append(Number(type(part).__name__, field.name, str(value), where, field.metadata["doc"]))
    return found


def steering():
    """All numbers that steer, as a list of Number."""
    return [number for number in [*defaults(), *weights(), *all_fields(), *all_constants()] if number.steers]


if __name__ == "__main__":
    for each in steering():
        print(f"{each.place:24} {each.name:28} {each.value:10} {each.origin:10} {each.what}")
    print(len(steering()))
