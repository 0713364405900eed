"""Describe a two-finger gripper by numbers: its TCP and what it occupies, for any opening."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.geometry.transforms import Pose
from torc.records import Hand


@dataclass(frozen=True)
class OrientedBox:
    """A box aligned with the axes of the frame it is given in (the TCP frame): centre and half edge lengths, metres."""

    center: Float[np.ndarray, "3"]
    half_size: Float[np.ndarray, "3"]


@dataclass(frozen=True, eq=False)
class GripperDescription:
    """A parallel gripper with two fingers.

    Its arrays never change, since what is computed from them is kept: make another one with `dataclasses.replace`.

    The TCP is midway between the distal ends of the fingertips; x is the closing direction, z points out of the
    gripper. Everything is tabulated over the opening.

    Attributes:
        joint_names: all of the gripper's joints in the MJCF.
        Ts_tool0_tcp: TCP in the flange's frame, per opening.
        actuator_lengths: length of the actuator's transmission, per opening.
        actuator_ctrl: command at which the actuator rests at that opening.
        finger_boxes_table: centre and half size of the finger at -x and +x, TCP frame, per opening.
        palm_boxes_table: centre and half size of every other piece, likewise.
    """

    name: str
    max_width_m: float
    pad_width_m: float
    pad_height_m: float
    joint_names: tuple[str, ...]
    widths_m: Float[np.ndarray, "k"]
    Ts_tool0_tcp: Float[np.ndarray, "k 4 4"]
    joint_qpos: Float[np.ndarray, "k j"]
    actuator_lengths: Float[np.ndarray, "k"]
    actuator_ctrl: Float[np.ndarray, "k"]
    finger_boxes_table: Float[np.ndarray, "k 2 2 3"]
    palm_boxes_table: Float[np.ndarray, "k p 2 3"]

    @property
    def hand(self) -> Hand:
        """How far it opens, and how far its fingers reach from the knuckles to their tips."""
        half_sizes = self.finger_boxes_table[-1, :, 1]
        return Hand(self.max_width_m, float(2 * half_sizes[:, 2].max()))

    def T_tool0_tcp(self, width_m: float) -> Pose:
        """Return the TCP in the flange's frame with pads width_m apart. Raises InputError outside 0..max_width_m."""
        return self._at(self.Ts_tool0_tcp, width_m)

    def Ts_tool0_tcp_at(self, widths_m: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 4 4"]:
        """Return `T_tool0_tcp` for many openings at once. Raises InputError if one is outside 0..max_width_m."""
        return self._at(self.Ts_tool0_tcp, np.asarray(widths_m, dtype=np.float64))

    def qpos(self, width_m: float) -> Float[np.ndarray, "j"]:
        """Return positions of joint_names at that opening."""
        return self._at(self.joint_qpos, width_m)

    def ctrl(self, width_m: float) -> float:
        """Return the actuator command that opens (or closes) the gripper to width_m."""
        return float(self._at(self.actuator_ctrl, width_m))

    def actuator_force(self, grip_force_n: float, width_m: float) -> float:
        """Return the actuator force with which each pad presses with grip_force_n, by virtual work: F dw = f dl."""
        rates = np.abs(np.gradient(self.widths_m, self.actuator_lengths))
        return float(grip_force_n * self._at(rates, width_m))

    def finger_boxes(self, width_m: float) -> tuple[OrientedBox, OrientedBox]:
        """Return what the two fingers (pads and blades, to the knuckles) occupy, TCP frame; at -x, then at +x."""
        left, right = self._at(self.finger_boxes_table, width_m)
        return OrientedBox(*left), OrientedBox(*right)

    def palm_boxes(self, width_m: float) -> tuple[OrientedBox, ...]:
        """Return what the rest of the gripper (palm, links, knuckles) occupies, TCP frame."""
        return tuple(OrientedBox(*box) for box in self._at(self.palm_boxes_table, width_m))

    def _at(self, table: np.ndarray, width_m: float | Float[np.ndarray, "n"]) -> np.ndarray:
        """Interpolate linearly in a table; a row per opening if there are several."""
        widths = np.asarray(width_m)
        wrong = ~((widths >= -1e-6) & (widths <= self.max_width_m + 1e-6))
        if wrong.any():
            asked = float(np.atleast_1d(widths)[np.atleast_1d(wrong)][0])
            raise InputError(f"{self.name} opens 0..{self.max_width_m:.3f} m; asked for {asked:.4f} m.")
        widths = np.clip(widths, 0.0, self.max_width_m)
        i = np.clip(np.searchsorted(self.widths_m, widths) - 1, 0, len(self.widths_m) - 2)
        s = (widths - self.widths_m[i]) / (self.widths_m[i + 1] - self.widths_m[i])
        s = s.reshape(s.shape + (1,) * (table.ndim - 1))
        return np.asarray((1.0 - s) * table[i] + s * table[i + 1])
