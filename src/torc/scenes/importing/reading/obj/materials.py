"""Materials of OBJ files (Wavefront, MTL)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from torc.scenes.importing.reading.texts import named_file, plain_text, without_comment

_OPTIONS = {
    b"-blendu": 1, b"-blendv": 1, b"-bm": 1, b"-boost": 1, b"-cc": 1, b"-clamp": 1, b"-imfchan": 1, b"-mm": 2,
    b"-texres": 1, b"-type": 1,
}  # fmt: skip
"""Of a texture, with how many words follow; -o, -s and -t are followed by one to three numbers."""
_VECTORS = (b"-o", b"-s", b"-t")


@dataclass(frozen=True)
class Material:
    """What is looked at of a material.

    Attributes:
        colour: diffuse, for the screen, 0 to 1; None if it has none.
        texture: file name of its picture, or None.
        scale, offset: of texture coordinates (v up): u' = scale u + offset.
    """

    colour: tuple[float, float, float] | None = None
    texture: str | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


def material_name(rest: bytes) -> bytes:
    """How a material is called in `newmtl` and `usemtl`, whatever lies between its words."""
    return b" ".join(rest.split())


def find_material(materials: Mapping[bytes, Material], name: bytes) -> Material | None:
    """The material of a name. What begins with a # is part of the name, or else a comment."""
    return materials.get(name) or materials.get(without_comment(name))


def read_materials(libraries: Iterable[bytes]) -> dict[bytes, Material]:
    """The materials of libraries by name; of one that is there twice, the first. What is not understood is left out."""
    found: dict[bytes, Material] = {}
    for text in dict.fromkeys(libraries):
        name, lines = None, dict[bytes, bytes]()
        for line in [*plain_text(text).split(b"\n"), b"newmtl"]:
            word, _, rest = line.strip().partition(b" ")
            if word.lower() == b"newmtl":
                if name is not None:
                    found.setdefault(name, _material(lines))
                name, lines = material_name(rest), {}
            else:
                lines[word.lower()] = rest
    for name in list(found):
        found.setdefault(without_comment(name), found[name])
    return found


def _material(lines: dict[bytes, bytes]) -> Material:
    texture, scale, offset = _texture(lines.get(b"map_kd") or lines.get(b"map_ka", b""))
    return Material(_colour(lines.get(b"kd", b"")), texture, scale, offset)


def _colour(rest: bytes) -> tuple[float, float, float] | None:
    numbers = _numbers(without_comment(rest).split()[:3])
    if len(numbers) not in (1, 3):
        return None  # none, or a spectrum
    r, g, b = (min(max(n, 0.0), 1.0) for n in (numbers * 3)[:3])
    return r, g, b


def _numbers(words: list[bytes]) -> list[float]:
    """The numbers that words begin with; not finite ones end them."""
    numbers = []
    for word in words:
        try:
            number = float(word)
        except ValueError:
            break
        if not abs(number) < 1e6:
            break
        numbers.append(number)
    return numbers


def _texture(rest: bytes) -> tuple[str | None, tuple[float, float], tuple[float, float]]:
    """File name, scale and offset."""
    words, vectors = named_file(rest).split(b" "), {b"-s": (1.0, 1.0), b"-o": (0.0, 0.0)}
    while words and (words[0] == b"" or words[0].lower() in _OPTIONS or words[0].lower() in _VECTORS):
        option = words.pop(0).lower()
        if option in _OPTIONS:
            del words[: _OPTIONS[option]]
        elif option:
            numbers = _numbers(words[:3])
            del words[: len(numbers)]
            default = vectors.get(option, (0.0, 0.0))[0]
            vectors[option] = ((*numbers, default, default)[0], (*numbers, default, default)[1])
    name = b" ".join(words).decode("utf-8", "replace")
    return name or None, vectors[b"-s"], vectors[b"-o"]
