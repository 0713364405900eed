"""The ROS camera against a fake rosbridge: both forms of messages, every encoding, and pictures that do not fit."""

import base64
import struct

import cv2
import numpy as np
import pytest

pytest.importorskip("websockets", reason="websockets is not installed")

from camera_scenes import COLOR, POSE, seen

from lab_helpers.rosbridge_server import Broken, FakeRosbridge, image_message, info_message
from torc.errors import CameraError, InputError
from torc.testing.camera_conformance import check_camera
from torc_lab.cameras.ros import RosCamera, RosConfig

TRUTH = seen(COLOR, POSE)
INFO = info_message(COLOR.K, COLOR.width, COLOR.height)
MM = np.round(TRUTH.depth_m * 1000).astype(np.uint16)
TOPICS = {"color": "/c", "depth": "/d", "info": "/i"}


def color(**more):
    return image_message(TRUTH.rgb, "rgb8", **more)


def depth(**more):
    return image_message(MM, "16UC1", **more)


def served(colors=(), depths=(), infos=(INFO,)):
    """A server of these messages."""
    return FakeRosbridge(
        {"/c": list(colors) or [color()], "/d": list(depths) or [depth()], "/i": list(infos)}
    )


def capture(server, **settings):
    config = RosConfig(url=server.url, **TOPICS, **({"timeout_s": 30} | settings))
    with server, RosCamera(config) as camera:
        return camera.capture()


def test_it_keeps_the_rules():
    with served() as server, RosCamera(RosConfig(url=server.url, **TOPICS)) as camera:
        check_camera(camera)


@pytest.mark.parametrize("ros", [1, 2])
def test_a_snapshot_is_what_was_published(ros):
    info = info_message(COLOR.K, COLOR.width, COLOR.height, ros=ros)
    o = capture(served([color(ros=ros, stamp_s=12.25)], [depth(ros=ros, stamp_s=12.3)], [info]))
    np.testing.assert_array_equal(o.rgb, TRUTH.rgb)
    np.testing.assert_allclose(o.depth_m, TRUTH.depth_m, atol=0.00051)
    np.testing.assert_array_equal(o.K, COLOR.K)
    assert o.stamp_s == pytest.approx(12.25)


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("padding", [0, 12])
def test_rows_may_be_padded_and_bytes_swapped(padding, big_endian):
    more = {"padding": padding, "big_endian": big_endian}
    metres = TRUTH.depth_m.copy()
    metres[:20], metres[20:30], metres[30:40] = np.nan, np.inf, -np.inf
    o = capture(served([color(padding=padding)], [image_message(metres, "32FC1", **more)]))
    assert (o.depth_m[:40] == 0).all()
    np.testing.assert_array_equal(o.depth_m[40:], TRUTH.depth_m[40:])
    np.testing.assert_array_equal(o.rgb, TRUTH.rgb)
    np.testing.assert_allclose(
        capture(served([], [depth(**more)])).depth_m, TRUTH.depth_m, rtol=0, atol=0.00051
    )


def test_blue_first_is_turned():
    message = image_message(np.ascontiguousarray(TRUTH.rgb[..., ::-1]), "bgr8")
    np.testing.assert_array_equal(capture(served([message])).rgb, TRUTH.rgb)


def test_pictures_of_one_moment_are_taken():
    """The newest of each is looked at until both show one moment."""
    colors = [color(stamp_s=s) for s in (10.0, 11.0)]
    o = capture(served(colors, [depth(stamp_s=11.05)]))
    assert o.stamp_s == 11.0
    with pytest.raises(CameraError, match=r"/d.* is 0\.500 s older than the other's.*--camera\.max-lag-s"):
        capture(served(colors, [depth(stamp_s=10.5)]), timeout_s=0.5)
    assert capture(served(colors, [depth(stamp_s=10.5)]), max_lag_s=1.0).stamp_s in (10.0, 11.0)


class Told:
    """Messages of a topic, one after another."""

    def __init__(self, topic, messages):
        self.topic, self._messages = topic, list(messages)

    def message(self):
        return self._messages.pop(0)


def test_the_older_picture_is_replaced_until_both_are_of_one_moment():
    for colors, depths in (((10.0, 10.4, 11.0), (11.05,)), ((11.0,), (10.0, 10.4, 11.05))):
        sources = (
            Told("/c", (color(stamp_s=s) for s in colors)),
            Told("/d", (depth(stamp_s=s) for s in depths)),
        )
        found = RosCamera()._of_one_moment(*sources)
        assert [picture.stamp_s for picture in found] == pytest.approx([11.0, 11.05])


def test_each_snapshot_subscribes_anew_and_ends_that():
    with served() as server, RosCamera(RosConfig(url=server.url, **TOPICS)) as camera:
        for _ in range(2):
            camera.capture()
        server.wait_for("unsubscribe /i")
        one = ["subscribe /i", "subscribe /c", "subscribe /d"]
        assert server.ops()[:3] == one
        assert sorted(server.ops()[3:6]) == sorted(f"un{op}" for op in one)
        assert server.ops()[6:9] == one
        assert len(server._sockets) == 1


def test_an_old_picture_is_not_taken_for_a_new_one():
    with served() as server, RosCamera(RosConfig(url=server.url, **TOPICS, timeout_s=0.5)) as camera:
        camera.capture()
        server.topics["/d"] = []
        with pytest.raises(CameraError, match="no message on /d"):
            camera.capture()


def test_a_lens_with_distortion_gives_the_pinholes_picture():
    info = info_message(COLOR.K, COLOR.width, COLOR.height, D=(-0.2, 0.05, 0.001, 0.002, 0.0))
    bent, straight = capture(served([], [], [info])), capture(served())
    np.testing.assert_array_equal(bent.K, COLOR.K)
    # The middle stays where it is; a barrel's rim moves outwards.
    np.testing.assert_array_equal(bent.depth_m[115:125, 155:165], straight.depth_m[115:125, 155:165])
    assert (bent.depth_m != straight.depth_m).mean() > 0.3
    # Rectified pictures have none left, and P in place of K.
    P = np.array([[240.0, 0, 150, 0], [0, 240, 110, 0], [0, 0, 1, 0]])
    info = info_message(COLOR.K, COLOR.width, COLOR.height, D=(-0.2, 0.05, 0, 0, 0), P=P)
    rectified = capture(served([], [], [info]), rectified=True)
    np.testing.assert_array_equal(rectified.K, P[:, :3])
    np.testing.assert_array_equal(rectified.depth_m, straight.depth_m)


def wrong(message, **changes):
    return [message | changes]


@pytest.mark.parametrize(
    ("messages", "text"),
    [
        ((wrong(color(), encoding="yuv422"),), r"/c has the encoding 'yuv422'; known are rgb8"),
        (([depth()],), "/c is 16UC1, not a colour picture"),
        (((), [color()]), "/d is rgb8, not depth"),
        (
            ((), wrong(depth(), data=depth()["data"][:400])),
            r"/d: its message is not one of sensor_msgs.*was cut .*\(240,640\)",
        ),
        (((), wrong(depth(), data="?")), "non-base64|base64"),
        (((), wrong(depth(), step=100)), "was cut.*Is this the right topic"),
        (((), wrong(depth(), height="tall")), "invalid literal for int.*tall"),
        (
            ((), [{"data": 1}]),
            "/d: its message is not one of sensor_msgs",
        ),
        (((), wrong(depth(), header={"stamp": {"secs": 1}})), "KeyError: .frame_id"),
        (((), [image_message(MM[::2, ::2], "16UC1")]), r"sizes differ: /c 320x240, /d 160x120, /i 320x240"),
        (((), (), [info_message(COLOR.K, 640, 480)]), r"/i 640x480 pixels\. Register depth"),
        (((), [depth(frame_id="depth")]), "in the frame 'color', /d in 'depth'.*--camera.same-frame"),
        (((), (), [info_message(0 * COLOR.K, 320, 240)]), "/i: its intrinsics are 0.*not calibrated"),
        (
            ((), (), wrong(INFO, K=[1, 2])),
            "/i: its message is not one of sensor_msgs.*size 2 into shape",
        ),
        (
            ((), (), wrong(INFO, D=[0.1] * 4, distortion_model="equidistant")),
            "'equidistant' is not known.*--camera.rectified",
        ),
        (((), [image_message(TRUTH.depth_m * 1000, "32FC1")]), "median depth is .* unit or scale"),
        (((), [image_message(np.full_like(TRUTH.depth_m, np.nan), "32FC1")]), "depth is empty"),
        (((), [image_message(-TRUTH.depth_m, "32FC1")]), "negative"),
    ],
)
def test_pictures_that_do_not_fit_are_refused_with_their_topic(messages, text):
    with pytest.raises(InputError, match=text):
        capture(served(*messages))


def test_a_wrong_frame_can_be_allowed():
    assert capture(served([], [depth(frame_id="depth")]), same_frame=False).depth_m.any()


@pytest.mark.parametrize(
    ("depths", "text"), [([Broken.CUT], "is lost"), ([Broken.REFUSED], "refuses: no such topic")]
)
def test_a_cut_or_refusal_is_told_at_once(depths, text):
    with pytest.raises(CameraError, match=f"The ROS camera: .*{text}"):
        capture(served([], depths), timeout_s=3000)


def test_silence_and_absence_are_told_and_the_next_snapshot_connects_anew():
    server = served()
    kept, server.topics = server.topics, {}
    with server, RosCamera(RosConfig(url=server.url, **TOPICS, timeout_s=0.5)) as camera:
        with pytest.raises(CameraError, match=r"no message on /i within .* Does anybody offer that"):
            camera.capture()
        server.topics = kept
        assert camera.capture().depth_m.any()
        gone = RosConfig(url=server.url)
    with pytest.raises(CameraError, match="cannot be reached"):
        RosCamera(gone).capture()


def test_settings_are_checked():
    with pytest.raises(InputError, match="above 0"):
        RosConfig(timeout_s=0)


def compressed(data, form, ros=1):
    """A CompressedImage as image_transport publishes it."""
    message = color(ros=ros)
    return {"header": message["header"], "format": form, "data": base64.b64encode(data).decode("ascii")}


def png(pixels):
    return cv2.imencode(".png", pixels)[1].tobytes()


ALPHA = np.full((*TRUTH.rgb.shape[:2], 1), 7, np.uint8)
GREY = cv2.cvtColor(TRUTH.rgb, cv2.COLOR_RGB2GRAY)


@pytest.mark.parametrize(
    "picture",
    [
        image_message(np.concatenate([TRUTH.rgb, ALPHA], axis=2), "rgba8"),
        image_message(np.concatenate([TRUTH.rgb[..., ::-1], ALPHA], axis=2), "bgra8"),  # ZED, Azure Kinect
        compressed(png(TRUTH.rgb[..., ::-1]), "rgb8; png compressed bgr8"),
        compressed(png(TRUTH.rgb[..., ::-1]), "png"),
    ],
)
def test_colours_in_other_forms(picture):
    np.testing.assert_array_equal(capture(served([picture])).rgb, TRUTH.rgb)


def test_grey_pictures_and_jpeg():
    grey = np.repeat(GREY[..., None], 3, axis=2)
    np.testing.assert_array_equal(capture(served([image_message(GREY, "mono8")])).rgb, grey)
    deep = GREY.astype(np.uint16) * 200
    seen_ = capture(served([image_message(deep, "mono16")])).rgb
    scaled = np.rint(GREY.astype(float) * 255 / GREY.max())
    np.testing.assert_allclose(seen_[..., 0], scaled, atol=1)
    jpeg = cv2.imencode(".jpg", TRUTH.rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    o = capture(served([compressed(jpeg, "bgr8; jpeg compressed bgr8")]))
    assert np.abs(o.rgb.astype(int) - TRUTH.rgb).mean() < 3


def test_depth_in_other_forms():
    """compressed_depth_image_transport: a header of 12 bytes, then millimetres, or inverse metres by a and b."""
    plain = struct.pack("<iff", 0, 0.0, 0.0) + png(MM)
    for picture in (image_message(MM, "mono16"), compressed(plain, "16UC1; compressedDepth png")):
        np.testing.assert_allclose(capture(served(depths=[picture])).depth_m, MM / 1000, atol=1e-6)
    metres, most = TRUTH.depth_m.astype(np.float64), 10.0
    a, b = 100.0 * 101.0, 1.0 - 100.0 * 101.0 / most  # depth_quantization 100, depth_max 10
    counts = np.where((metres > 0) & (metres < most), np.rint(a / np.maximum(metres, 1e-3) + b), 0)
    quantized = struct.pack("<iff", 0, a, b) + png(np.clip(counts, 0, 65535).astype(np.uint16))
    seen_ = capture(served(depths=[compressed(quantized, "32FC1; compressedDepth png")])).depth_m
    there = counts > 0
    np.testing.assert_allclose(seen_[there], metres[there], rtol=1e-3)
    assert not seen_[~there].any()


@pytest.mark.parametrize(
    ("picture", "text"),
    [
        (compressed(b"no picture at all", "jpeg"), "not a picture as JPEG or PNG"),
        (compressed(b"\0" * 5, "16UC1; compressedDepth png"), "was cut"),
        (compressed(b"\0" * 12 + png(GREY), "16UC1; compressedDepth png"), "16 bits"),
        (compressed(b"\0" * 40, "16UC1; compressedDepth rvl"), "compressedDepth/format to png"),
        ({**compressed(b"", "jpeg"), "data": 7}, "was cut"),
    ],
)
def test_compressed_pictures_that_cannot_be_read(picture, text):
    with pytest.raises(InputError, match=text):
        capture(served(depths=[picture]))


def test_a_time_out_says_what_is_published():
    topics = ["/zed/rgb/image_rect_color", "/tf", "/zed/depth/depth_registered"]
    kinds = ["sensor_msgs/Image", "tf2_msgs/TFMessage", "sensor_msgs/msg/Image"]
    server = served()
    server.topics, server.services = {}, {"/rosapi/topics": {"topics": topics, "types": kinds}}
    with pytest.raises(
        CameraError, match=r"Published are: /zed/depth/.* \(sensor_msgs/msg/Image\), /zed/rgb"
    ) as error:
        capture(server, timeout_s=0.3)
    assert "/tf" not in str(error.value)
