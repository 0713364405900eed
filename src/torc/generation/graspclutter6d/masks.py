"""A look at the mask pictures of one view: they are not needed for the poses, but they show faulty annotations.

Known faults: more masks than objects (scene 117, picture 1), objects whose mask is empty (scenes 401 and 404, picture
7); https://github.com/SeungBack/graspclutter6dAPI/issues/2 and /3.
"""

import io
import re
import warnings
from pathlib import Path

from PIL import Image

from torc.errors import InputError
from torc.files.reading import read_bytes
from torc.generation.graspclutter6d.annotations import AnnotatedScene

_MAX_SIDE_PX = 4096
_MAX_BYTES = 8 * 2**20


def mask_notes(scene: AnnotatedScene) -> tuple[str, ...]:
    """What the masks of the scene's picture say against its annotation; nothing where no masks are unpacked.

    Raises:
        InputError: a mask is no PNG, or absurdly large.
    """
    folder, image = scene.directory / "mask", scene.view.image
    if not folder.is_dir():
        return ()
    pattern = re.compile(rf"{image:06d}_(\d{{6}})\.png")
    numbers = sorted(int(m.group(1)) for p in folder.iterdir() if (m := pattern.fullmatch(p.name)))
    if not numbers:
        return ()
    notes, count = [], len(scene.view.objects)
    beyond = [n for n in numbers if n >= count]
    if beyond:
        notes.append(
            f"picture {image} has {len(beyond)} more masks than annotated objects; they are not used"
        )
    names = [o.name for o in scene.view.objects]
    missing = [names[i] for i in range(count) if i not in numbers]
    if missing:
        notes.append(f"picture {image} has no mask of {', '.join(missing)}")
    empty = [names[i] for i in numbers if i < count and _is_empty(folder / f"{image:06d}_{i:06d}.png")]
    if empty:
        notes.append(f"the mask of {', '.join(empty)} is empty in picture {image}; the pose may be wrong")
    return tuple(notes)


def _is_empty(path: Path) -> bool:
    data = read_bytes(path, _MAX_BYTES, "a mask")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
                if max(image.size) > _MAX_SIDE_PX:
                    raise InputError(
                        f"{path} is {image.width}x{image.height} pixels; a mask has at most {_MAX_SIDE_PX} a side."
                    )
                return image.getbbox() is None
    except (
        Image.DecompressionBombError,
        Image.DecompressionBombWarning,
        OSError,
        SyntaxError,
        ValueError,
    ) as error:
        raise InputError(
            f"{path} is no readable PNG: {error}. Unpack it again, or remove the folder mask/."
        ) from None
