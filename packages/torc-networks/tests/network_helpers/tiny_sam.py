"""Grounding DINO, SAM 2.1 and SAM 3 of a few hundred kilobytes with random weights: what they say means nothing, but it
comes through the real processors, models and post-processing of transformers.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

WORDS = "a the red blue green yellow box can mug object tuna"
_SAM2_PX, _SAM3_PX = 128, 168
_SPREAD = 0.2
"""Of the weights: with less, logits are all but 0."""


def import_torchvision() -> None:
    """torchvision from PyPI is made for CUDA and finds no operators beside a torch for the processor. The networks here
    call none of them: declared, they let it be imported. Raises ImportError where it is not installed.
    """
    import torch

    if not hasattr(torch.ops.torchvision, "nms") and "torchvision" not in sys.modules:
        library = torch.library.Library("torchvision", "DEF")
        for name in ("nms", "qnms"):
            library.define(f"{name}(Tensor dets, Tensor scores, float iou_threshold) -> Tensor")
        _KEPT.append(library)
    import torchvision  # noqa: F401


_KEPT: list[object] = []
"""Operators are gone once their library is."""


def save_grounding_dino(folder: Path) -> None:
    """20 boxes for any text of the words above."""
    from transformers import (
        BertConfig,
        BertTokenizer,
        GroundingDinoConfig,
        GroundingDinoForObjectDetection,
        GroundingDinoImageProcessor,
        GroundingDinoProcessor,
        SwinConfig,
    )

    swin = SwinConfig(
        embed_dim=12,
        depths=[1] * 4,
        num_heads=[1, 1, 2, 2],
        window_size=4,
        image_size=224,
        out_indices=[2, 3, 4],
    )
    bert = BertConfig(
        vocab_size=1100, hidden_size=32, num_hidden_layers=1, num_attention_heads=2, intermediate_size=64
    )
    config = GroundingDinoConfig(
        backbone_config=swin.to_dict(),
        text_config=bert.to_dict(),
        d_model=32,
        encoder_layers=2,
        decoder_layers=2,
        encoder_attention_heads=4,
        decoder_attention_heads=4,
        encoder_ffn_dim=64,
        decoder_ffn_dim=64,
        num_queries=20,
        disable_custom_kernels=True,
    )
    _seed()
    GroundingDinoForObjectDetection(config).save_pretrained(folder)
    images = GroundingDinoImageProcessor(size={"shortest_edge": 96, "longest_edge": 160})
    GroundingDinoProcessor(images, BertTokenizer(vocab=_bert_words())).save_pretrained(folder)


def _bert_words() -> dict[str, int]:
    """The model knows the ids of these special tokens by heart."""
    special = {"[PAD]": 0, "[UNK]": 100, "[CLS]": 101, "[SEP]": 102, "[MASK]": 103, ".": 1012, "?": 1029}
    known = special | {word: 1040 + i for i, word in enumerate(WORDS.split())}
    names = {number: word for word, number in known.items()}
    return {names.get(i, f"[unused{i}]"): i for i in range(1100)}


def save_sam2(folder: Path) -> None:
    """A mask for each box."""
    from transformers import Sam2Model

    _seed()
    Sam2Model(sam2_config()).save_pretrained(folder)
    sam2_processor().save_pretrained(folder)


def save_sam2_video(folder: Path) -> None:
    """The same as a video model with its tracker, as the hub has it."""
    from transformers import Sam2VideoConfig, Sam2VideoModel, Sam2VideoProcessor, Sam2VideoVideoProcessor

    plain = sam2_config()
    config = Sam2VideoConfig(
        vision_config=plain.vision_config.to_dict(),
        prompt_encoder_config=plain.prompt_encoder_config.to_dict(),
        mask_decoder_config=plain.mask_decoder_config.to_dict(),
        image_size=_SAM2_PX,
        memory_attention_hidden_size=16,
        memory_attention_num_layers=1,
        memory_attention_num_attention_heads=1,
        memory_attention_feed_forward_hidden_size=16,
        memory_attention_rope_feat_sizes=[8, 8],
        memory_encoder_hidden_size=16,
        memory_encoder_output_channels=8,
        mask_downsampler_embed_dim=16,
        memory_fuser_num_layers=1,
        memory_fuser_embed_dim=16,
        memory_fuser_intermediate_dim=16,
    )
    _seed()
    Sam2VideoModel(config).save_pretrained(folder)
    images = sam2_processor().image_processor
    Sam2VideoProcessor(images, Sam2VideoVideoProcessor(), target_size=_SAM2_PX).save_pretrained(folder)


def sam2_config() -> Any:
    """A SAM 2.1 for pictures of 128 pixels."""
    from transformers import (
        Sam2Config,
        Sam2HieraDetConfig,
        Sam2MaskDecoderConfig,
        Sam2PromptEncoderConfig,
        Sam2VisionConfig,
    )

    # A block with global attention must not be the first of its stage.
    hiera = Sam2HieraDetConfig(
        hidden_size=4,
        image_size=[_SAM2_PX, _SAM2_PX],
        blocks_per_stage=[1, 1, 2, 1],
        embed_dim_per_stage=[4, 8, 16, 32],
        num_attention_heads_per_stage=[1, 1, 2, 2],
        window_size_per_stage=[4, 4, 4, 2],
        global_attention_blocks=[3],
        window_positional_embedding_background_size=[4, 4],
    )
    vision = Sam2VisionConfig(
        backbone_config=hiera.to_dict(),
        backbone_channel_list=[32, 16, 8, 4],
        backbone_feature_sizes=[[32, 32], [16, 16], [8, 8]],
        fpn_hidden_size=16,
    )
    prompts = Sam2PromptEncoderConfig(
        hidden_size=16, image_size=_SAM2_PX, patch_size=16, mask_input_channels=4
    )
    masks = Sam2MaskDecoderConfig(hidden_size=16, mlp_dim=32, num_attention_heads=2, iou_head_hidden_dim=16)
    return Sam2Config(
        initializer_range=_SPREAD,
        vision_config=vision.to_dict(),
        prompt_encoder_config=prompts.to_dict(),
        mask_decoder_config=masks.to_dict(),
    )


def sam2_processor() -> Any:
    """What prepares its pictures."""
    from transformers import Sam2ImageProcessor, Sam2Processor

    images = Sam2ImageProcessor(
        size={"height": _SAM2_PX, "width": _SAM2_PX}, mask_size={"height": 32, "width": 32}
    )
    return Sam2Processor(images, target_size=_SAM2_PX)


def save_sam3(folder: Path) -> None:
    """12 masks for any words in small letters."""
    from transformers import (
        CLIPTextConfig,
        CLIPTokenizer,
        Sam3Config,
        Sam3ImageProcessor,
        Sam3Model,
        Sam3Processor,
        Sam3VisionConfig,
        Sam3ViTConfig,
    )

    vit = Sam3ViTConfig(
        hidden_size=32,
        intermediate_size=64,
        num_hidden_layers=2,
        num_attention_heads=2,
        image_size=_SAM3_PX,
        window_size=4,
        global_attn_indexes=[1],
        pretrain_image_size=84,
    )
    vision = Sam3VisionConfig(
        backbone_config=vit.to_dict(),
        fpn_hidden_size=32,
        backbone_feature_sizes=[[48, 48], [24, 24], [12, 12]],
    )
    text = CLIPTextConfig(
        vocab_size=64,
        hidden_size=32,
        intermediate_size=64,
        projection_dim=32,
        num_hidden_layers=1,
        num_attention_heads=2,
        max_position_embeddings=32,
        bos_token_id=0,
        eos_token_id=1,
        pad_token_id=1,
    )
    layers = {"hidden_size": 32, "num_layers": 1, "num_attention_heads": 2, "intermediate_size": 64}
    config = Sam3Config(
        initializer_range=_SPREAD,
        vision_config=vision.to_dict(),
        text_config=text.to_dict(),
        geometry_encoder_config=layers,
        detr_encoder_config=layers,
        detr_decoder_config=layers | {"num_queries": 12},
        mask_decoder_config={"hidden_size": 32, "num_attention_heads": 2},
    )
    _seed()
    Sam3Model(config).save_pretrained(folder)
    letters = "abcdefghijklmnopqrstuvwxyz"
    names = ["<|startoftext|>", "<|endoftext|>", *letters, *(f"{c}</w>" for c in letters)]
    tokenizer = CLIPTokenizer(vocab={name: i for i, name in enumerate(names)}, merges=[])
    images = Sam3ImageProcessor(size={"height": _SAM3_PX, "width": _SAM3_PX})
    Sam3Processor(images, tokenizer, target_size=_SAM3_PX).save_pretrained(folder)


SAVERS: dict[str, Callable[[Path], None]] = {
    "dino": save_grounding_dino,
    "sam2": save_sam2,
    "sam2-video": save_sam2_video,
    "sam3": save_sam3,
}


def _seed() -> None:
    import torch

    torch.manual_seed(20260101)
