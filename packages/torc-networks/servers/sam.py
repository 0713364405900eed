"""Written against the documented interface; not yet run.

Masks for `--perception network`, by transformers: Grounding DINO finds boxes by words and SAM 2 fills them, or SAM 3
does both (`--model sam3`).

Install, in an environment of its own (torch and torchvision from the same index):
    pip install torch torchvision "transformers>=5.20" pillow
    pip install --no-deps -e PATH_TO_TORC -e PATH_TO_TORC/packages/torc-networks
    pip install numpy pyzmq msgpack jaxtyping
Run:
    python packages/torc-networks/servers/sam.py
    torc run structured-03 --perception network
Weights are fetched from Hugging Face at the first start. Licences: Grounding DINO and SAM 2.1 are Apache-2.0; SAM 3 has
the SAM licence and is given out on request.
"""

import argparse
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from PIL import Image
from transformers import (
    AutoModelForZeroShotObjectDetection,
    AutoProcessor,
    Sam2Model,
    Sam2Processor,
    Sam3Model,
    Sam3Processor,
)

from torc_networks.fields import request
from torc_networks.server import serve

Finder = Callable[[Image.Image, str], tuple[np.ndarray, np.ndarray]]


def sam2_finder(device: str, threshold: float) -> Finder:
    """Boxes by words, then a mask for each."""
    dino_name, sam_name = "IDEA-Research/grounding-dino-tiny", "facebook/sam2.1-hiera-tiny"
    dino_processor = AutoProcessor.from_pretrained(dino_name)
    dino = AutoModelForZeroShotObjectDetection.from_pretrained(dino_name).to(device).eval()
    sam_processor, sam = (
        Sam2Processor.from_pretrained(sam_name),
        Sam2Model.from_pretrained(sam_name).to(device).eval(),
    )

    def find(picture: Image.Image, words: str) -> tuple[np.ndarray, np.ndarray]:
        given = dino_processor(images=picture, text=words, return_tensors="pt").to(device)
        found = dino_processor.post_process_grounded_object_detection(
            dino(**given),
            given["input_ids"],
            threshold=threshold,
            text_threshold=threshold,
            target_sizes=[picture.size[::-1]],
        )[0]
        if len(found["boxes"]) == 0:
            return np.zeros((0, *picture.size[::-1]), bool), np.zeros(0, np.float32)
        boxes = [found["boxes"].cpu().tolist()]
        given = sam_processor(images=picture, input_boxes=boxes, return_tensors="pt").to(device)
        out = sam(**given, multimask_output=False)
        masks = sam_processor.post_process_masks(out.pred_masks.cpu(), given["original_sizes"].cpu())[0]
        return masks[:, 0].numpy().astype(bool), found["scores"].float().cpu().numpy()

    return find


def sam3_finder(device: str, threshold: float) -> Finder:
    """Masks by words."""
    processor = Sam3Processor.from_pretrained("facebook/sam3")
    model = Sam3Model.from_pretrained("facebook/sam3").to(device).eval()

    def find(picture: Image.Image, words: str) -> tuple[np.ndarray, np.ndarray]:
        given = processor(images=picture, text=words.rstrip(". "), return_tensors="pt").to(device)
        sizes = given["original_sizes"].tolist()
        found = processor.post_process_instance_segmentation(
            model(**given), threshold=threshold, mask_threshold=0.5, target_sizes=sizes
        )[0]
        masks = found["masks"].cpu().numpy().astype(bool).reshape(-1, *picture.size[::-1])
        return masks, found["scores"].float().cpu().numpy()

    return find


def main() -> None:
    """Serve `segment`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", choices=("sam2", "sam3"), default="sam2")
    parser.add_argument("--threshold", type=float, default=0.25)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--port", type=int, default=5554)
    options = parser.parse_args()
    find = (sam2_finder if options.model == "sam2" else sam3_finder)(options.device, options.threshold)

    @torch.inference_mode()
    def segment(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        picture = Image.fromarray(fields.bytes("rgb", (None, None, 3)))
        masks, scores = find(picture, str(asked.get("prompt") or "object."))
        return {"masks": masks, "scores": np.clip(scores, 0, 1)}

    serve({"segment": segment}, options.model, options.port)


if __name__ == "__main__":
    main()
