"""Boxes and cartons. Sizes are depth (x), width (y), height (z) in metres."""

from typing import Any

from tools.objects.kinds import (
    BLACK,
    BLUE,
    BROWN,
    CREAM,
    GREEN,
    ORANGE,
    PINK,
    PURPLE,
    RED,
    SKY,
    TEAL,
    WHITE,
    YELLOW,
    Kind,
    Variant,
    look,
)  # fmt: skip

Size = tuple[float, float, float]


def _box(
    name: str, words: str, mass_kg: float, size_m: Size, design: dict[str, Any], **faces: Any
) -> Variant:
    """A plain box."""
    params: dict[str, Any] = {"size_m": size_m, "design": design}
    return Variant(name, words, mass_kg, {**params, "faces": faces} if faces else params)


def _milk(
    name: str, words: str, mass_kg: float, size_m: Size, gable_m: float, design: dict[str, Any]
) -> Variant:
    """A gable-top carton."""
    return Variant(
        name, words, mass_kg, {"size_m": size_m, "gable_m": gable_m, "fin_m": 0.012, "design": design}
    )


_STRIKER = {"left": look("#4a2a1a", "", "#4a2a1a", WHITE), "right": look("#4a2a1a", "", "#4a2a1a", WHITE)}
_MATCHES_RED = look(RED, "MATCHES", YELLOW, RED, "flame", ORANGE)
_MATCHES_GREEN = look(GREEN, "MATCHES", CREAM, GREEN, "flame", ORANGE)
_MATCHES_BLUE = look(BLUE, "MATCHES", WHITE, BLUE, "flame", ORANGE)

KINDS = (
    Kind("cracker_box", "boxes:carton", (
        _box("cracker_box_red", "the red cracker box", 0.41, (0.060, 0.158, 0.210),
             look(RED, "CRACKERS", WHITE, RED, "squares", "#e9c27a", YELLOW)),
        _box("cracker_box_teal", "the teal cracker box", 0.30, (0.050, 0.130, 0.175),
             look(TEAL, "CRISP\nCRACKERS", CREAM, TEAL, "squares", "#e9c27a")),
        _box("cracker_box_green", "the small green rye cracker box", 0.20, (0.045, 0.110, 0.150),
             look(GREEN, "RYE\nCRISP", CREAM, GREEN, "squares", "#c99a5b", "#c99a5b")),
    )),
    Kind("cereal_box", "boxes:carton", (
        _box("cereal_box_yellow", "the yellow cereal box", 0.45, (0.055, 0.180, 0.265),
             look(YELLOW, "CORN\nFLAKES", GREEN, WHITE, "sun", ORANGE, GREEN)),
        _box("cereal_box_purple", "the purple cereal box", 0.38, (0.050, 0.160, 0.230),
             look(PURPLE, "CHOCO\nRINGS", YELLOW, PURPLE, "bowl", WHITE)),
        _box("cereal_box_sky", "the small sky blue muesli box", 0.33, (0.048, 0.140, 0.200),
             look(SKY, "MUESLI", WHITE, BLUE, "bowl", BLUE, BLUE)),
    )),
    Kind("pudding_box", "boxes:carton", (
        _box("pudding_box_brown", "the brown chocolate pudding box", 0.11, (0.030, 0.085, 0.075),
             look(BROWN, "CHOCOLATE\nPUDDING", CREAM, BROWN, "bowl", CREAM)),
        _box("pudding_box_pink", "the pink strawberry pudding box", 0.11, (0.030, 0.085, 0.075),
             look(PINK, "STRAWBERRY\nPUDDING", WHITE, RED, "fruit", RED)),
        _box("pudding_box_lemon", "the yellow lemon jelly box", 0.095, (0.028, 0.080, 0.068),
             look(YELLOW, "LEMON\nJELLY", WHITE, GREEN, "leaf", GREEN)),
    )),
    Kind("tea_box", "boxes:carton", (
        _box("tea_box_green", "the green tea box", 0.09, (0.065, 0.130, 0.075),
             look(GREEN, "GREEN TEA", CREAM, GREEN, "leaf", GREEN)),
        _box("tea_box_black", "the black tea box", 0.12, (0.070, 0.075, 0.125),
             look(BLACK, "BLACK\nTEA", YELLOW, BLACK, "leaf", "#c9a03a", YELLOW)),
        _box("tea_box_purple", "the purple berry tea box", 0.08, (0.060, 0.110, 0.070),
             look(PURPLE, "BERRY TEA", WHITE, PURPLE, "fruit", RED)),
    ), held_out=True),
    Kind("sugar_box", "boxes:carton", (
        _box("sugar_box_white", "the white sugar box", 0.51, (0.045, 0.090, 0.150),
             look(WHITE, "SUGAR", BLUE, WHITE, "squares", SKY, BLUE)),
        _box("sugar_box_brown", "the brown cane sugar box", 0.49, (0.045, 0.090, 0.150),
             look("#b98a4e", "CANE\nSUGAR", CREAM, BROWN, "squares", "#8b5a2b")),
        _box("sugar_box_pink", "the small pink icing sugar box", 0.26, (0.040, 0.075, 0.120),
             look(PINK, "ICING\nSUGAR", WHITE, PURPLE, "star", WHITE)),
    )),
    Kind("milk_carton", "boxes:gable_carton", (
        _milk("milk_carton_blue", "the blue milk carton", 1.03, (0.070, 0.070, 0.230), 0.033,
              look(WHITE, "MILK", BLUE, WHITE, "drop", SKY, BLUE)),
        _milk("milk_carton_small", "the small red milk carton", 0.52, (0.064, 0.064, 0.145), 0.028,
              look(WHITE, "WHOLE\nMILK", RED, WHITE, "drop", "#f3a6a0", RED)),
        _milk("juice_carton_orange", "the orange juice carton", 1.05, (0.070, 0.070, 0.230), 0.033,
              look(ORANGE, "ORANGE\nJUICE", WHITE, ORANGE, "fruit", "#ffb347")),
    )),
    Kind("soap_box", "boxes:carton", (
        _box("soap_box_violet", "the violet soap box", 0.11, (0.058, 0.092, 0.034),
             look("#b9a3dd", "SOAP", WHITE, PURPLE, "drop", PURPLE)),
        _box("soap_box_white", "the white soap box", 0.10, (0.058, 0.092, 0.034),
             look(WHITE, "PURE SOAP", SKY, BLUE, "drop", BLUE)),
        _box("soap_box_green", "the green olive soap box", 0.13, (0.062, 0.096, 0.038),
             look(GREEN, "OLIVE SOAP", CREAM, GREEN, "leaf", "#6f8f2a")),
    )),
    Kind("matchbox", "boxes:carton", (
        _box("matchbox_red", "the red matchbox", 0.045, (0.065, 0.110, 0.022), _MATCHES_RED,
            top=_MATCHES_RED, **_STRIKER),
        _box("matchbox_blue", "the blue matchbox", 0.045, (0.065, 0.110, 0.022), _MATCHES_BLUE,
            top=_MATCHES_BLUE, **_STRIKER),
        _box("matchbox_green", "the small green matchbox", 0.030, (0.053, 0.090, 0.020), _MATCHES_GREEN,
            top=_MATCHES_GREEN, **_STRIKER),
    )),
    Kind("book", "boxes:book", (
        Variant("book_blue", "the blue book", 0.28, {
            "size_m": (0.175, 0.115, 0.026), "design": look(BLUE, "SEA\nSTORIES", WHITE, BLUE, "fish", SKY)}),
        Variant("book_red", "the red book", 0.22, {
            "size_m": (0.160, 0.110, 0.020),
                "design": look("#9b1c2e", "STAR\nATLAS", YELLOW, BLACK, "star", YELLOW)}),
        Variant("book_green", "the thick green book", 0.34, {
            "size_m": (0.155, 0.105, 0.038),
                "design": look(GREEN, "GARDEN\nGUIDE", CREAM, GREEN, "leaf", "#bfe86a")}),
    )),
)  # fmt: skip
