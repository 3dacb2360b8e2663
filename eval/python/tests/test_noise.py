"""Noise on arrays: the bits of C++, and what is refused."""

import copy
import json
import os
import pathlib
import pickle
import subprocess
import tempfile
import unittest
import warnings

import numpy

import sextant

CAMERA = sextant.Camera(725.0, 725.0, 620.5, 187.0, 387.57)
WIDTH, HEIGHT = 1250, 800  # 10^6 pixels
SPATIAL = {"model": "spatial", "lengths_px": [5, 40], "shares": [0.4, 0.5]}
NOISES = [
    {"depth": {"delta_d_px": 0.2}, "flow": {"epe_x_px": 0.3, "epe_y_px": 0.2}},
    {"depth": {"delta_d_px": 1.5, "baseline_m": 0}, "flow": {"epe_px": 0.5}, "correlation": SPATIAL},
    {"depth": {"delta_d_px": 0.1}, "flow": {"epe_px": 1}, "correlation": "shared_per_frame"},
    {"flow": {"epe_px": 0.5, "bodies": {"background": {"epe_px": 1}, "object:3": {"epe_x_px": 2}}},
     "outliers": {"share": 0.3, "radius_px": 50}, "mask": {"erode_px": 2, "dilate_px": 1},
     "quantisation": {"step_px": 0.0625}},
    {"profile": "pwc_net_kitti03", "scale": 0.5},
]


def setUpModule():
    warnings.filterwarnings("ignore", "depth noise is added for a baseline")  # tested by Baseline


def frame_arrays():
    """A million pixels, some of them no measurement."""
    random = numpy.random.default_rng(7)
    depth = random.uniform(2, 80, (HEIGHT, WIDTH)).astype(numpy.float32)
    flow = random.normal(0, 8, (HEIGHT, WIDTH, 2)).astype(numpy.float32)
    backward = random.normal(0, 8, (HEIGHT, WIDTH, 2)).astype(numpy.float32)
    mask = numpy.zeros((HEIGHT, WIDTH), numpy.uint16)
    for instance in range(1, 9):
        y, x = random.integers(0, HEIGHT - 100), random.integers(0, WIDTH - 200)
        mask[y:y + 100, x:x + 200] = instance * 37 if instance > 4 else instance
    depth[random.random((HEIGHT, WIDTH)) < 0.05] = numpy.nan
    depth[:3] = 0
    flow[random.random((HEIGHT, WIDTH)) < 0.05] = numpy.nan
    return {"depth": depth, "flow": flow, "backward_flow": backward, "mask": mask}


def reference(noise, seed, dataset, sequence, frame, arrays):
    """Compares with the noise of the C++ program."""
    with tempfile.TemporaryDirectory() as folder:
        given, made = pathlib.Path(folder) / "in", pathlib.Path(folder) / "out"
        given.write_bytes(b"".join(array.tobytes() for array in arrays.values()))
        camera = [repr(value) for value in (CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, CAMERA.bf)]
        subprocess.run([os.environ["SEXTANT_NOISE_REFERENCE"], json.dumps(noise), str(seed), dataset, sequence, str(frame),
                        *camera, str(WIDTH), str(HEIGHT), given, made], check=True)
        data = made.read_bytes()
    out, at = {}, 0
    for name, array in arrays.items():
        out[name] = data[at:at + array.nbytes]
        at += array.nbytes
    return out


class Bits(unittest.TestCase):
    def test_are_those_of_cpp_on_a_million_pixels(self):
        arrays = frame_arrays()
        self.assertGreaterEqual(arrays["depth"].size, 10**6)
        for k, noise in enumerate(NOISES):
            seed, frame = [0, 5, 2**64 - 1, 12345, 9][k], [0, 17, 3, 2**31 - 1, 1][k]
            with self.subTest(noise=noise):
                noisy = sextant.Noise(noise).apply(seed=seed, dataset="kitti", sequence="0003", frame=frame, camera=CAMERA,
                                                   missing="keep", **arrays)
                expected = reference(noise, seed, "kitti", "0003", frame, arrays)
                changed = 0
                for name, array in arrays.items():
                    self.assertEqual(getattr(noisy, name).tobytes(), expected[name], name)
                    changed += getattr(noisy, name).tobytes() != array.tobytes()
                self.assertGreaterEqual(changed, 2, "there was noise")

    def test_depend_on_every_part_of_the_draw(self):
        depth = numpy.full((4, 5), 10, numpy.float32)
        noise = sextant.Noise({"depth": {"delta_d_px": 0.2}})
        base = {"seed": 0, "dataset": "a", "sequence": "b", "frame": 0}
        draw = lambda **other: noise.apply(**{**base, **other}, camera=CAMERA, depth=depth).depth.tobytes()
        self.assertEqual(draw(), draw())
        for other in ({"seed": 1}, {"dataset": "c"}, {"sequence": "c"}, {"frame": 1}):
            self.assertNotEqual(draw(), draw(**other), other)

    def test_copies_draw_the_same(self):
        depth = numpy.full((4, 5), 10, numpy.float32)
        for options in NOISES:
            noise = sextant.Noise(options)
            for other in (copy.deepcopy(noise), copy.copy(noise), pickle.loads(pickle.dumps(noise))):
                self.assertEqual((other.name, other.options), (noise.name, noise.options))
                draws = [each.apply(seed=0, dataset="a", sequence="b", frame=0, camera=CAMERA, depth=depth).depth
                         for each in (noise, other)]
                numpy.testing.assert_array_equal(*draws)

    def test_input_stays_and_any_unsigned_mask_does(self):
        depth, mask = numpy.full((40, 50), 10, numpy.float32), numpy.zeros((40, 50), numpy.uint16)
        mask[10:30, 10:30] = 200
        noise = sextant.Noise({"depth": {"delta_d_px": 0.2}, "mask": {"erode_px": 2}})
        place = {"seed": 0, "dataset": "a", "sequence": "b", "frame": 0, "camera": CAMERA}
        expected = noise.apply(depth=depth, mask=mask, **place)
        self.assertTrue((depth == 10).all() and (mask == 200).sum() == 400)
        self.assertEqual((expected.mask == 200).sum(), 256)
        for kind in ("uint8", "uint32", "uint64", "int32", "int64", ">u2", ">i4"):
            noisy = noise.apply(depth=depth, mask=mask.astype(kind), **place)
            self.assertEqual(noisy.mask.dtype, numpy.dtype(kind).newbyteorder("="))
            self.assertTrue((noisy.mask == expected.mask).all())
        for other in (mask.tolist(), numpy.asfortranarray(mask), numpy.repeat(mask, 2, axis=1)[:, ::2]):
            noisy = noise.apply(depth=depth, mask=other, **place)
            self.assertEqual(noisy.mask.dtype, numpy.uint16)
            self.assertTrue((noisy.mask == expected.mask).all())
        self.assertEqual(expected.achieved["depth"]["n"], 2000)
        self.assertAlmostEqual(expected.achieved["depth"]["normalised_sigma"], 1, delta=0.1)


    def test_numbers_of_numpy_are_numbers(self):
        plain = {"depth": {"delta_d_px": 0.2}, "correlation": SPATIAL}
        for number, numbers in ((numpy.float32, lambda values: numpy.array(values, numpy.float32)), (numpy.float64, numpy.array)):
            correlation = {"model": "spatial", "lengths_px": numbers([5, 40]), "shares": numbers([0.4, 0.5])}
            noise = sextant.Noise({"depth": {"delta_d_px": number(0.2)}, "correlation": correlation})
            self.assertEqual(noise.options, sextant.Noise(plain).options)
        self.assertEqual(sextant.Noise({"mask": {"erode_px": numpy.int64(2)}}).options, sextant.Noise({"mask": {"erode_px": 2}}).options)
        for bad in (numpy.array([1j]), numpy.float32("nan"), numpy.ma.masked_equal([1, 2], 1), {1, 2}, numpy.datetime64("2020")):
            with self.assertRaisesRegex(sextant.Error, "noise: expected values that JSON can represent"):
                sextant.Noise({"depth": {"delta_d_px": bad}})


class Baseline(unittest.TestCase):
    """Depth noise has the paper's baseline, 0.5 m, unless baseline_m is given; the camera's may be another."""

    def warned(self, options, bf, **arrays):
        arrays = arrays or {"depth": numpy.full((2, 3), 10.0)}
        camera = sextant.Camera(525.0, 525.0, 1.0, 1.0, bf)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            sextant.Noise(options).apply(seed=0, dataset="a", sequence="b", frame=0, camera=camera, **arrays)
        return [(str(each.message), each.filename) for each in caught]

    def test_another_one_of_the_camera_is_warned_of(self):
        depth = {"delta_d_px": 0.2}
        self.assertEqual(self.warned({"depth": depth}, 40.0), [(
            "depth noise is added for a baseline of 0.5 m, but the camera's is bf / fx = 0.07619 m: give 'baseline_m': 0 beside "
            "delta_d_px for the camera's, or 'baseline_m': 0.5", __file__)])
        self.assertEqual(len(self.warned(json.dumps({"depth": depth, "quantisation": {"step_px": 0.1, "baseline_m": 0.5}}), 276.0)), 1)
        for options, bf in (({"depth": depth}, 262.5), ({"depth": depth}, 275.0), ({"depth": depth}, 250.0),
                            ({"depth": {**depth, "baseline_m": 0.5}}, 40.0), ({"depth": {**depth, "baseline_m": 0}}, 40.0),
                            ({"depth": {"delta_d_px": 0}}, 40.0), ("none", 40.0), ({"flow": {"epe_px": 1}}, 40.0),
                            ({"profile": "pwc_net_kitti03"}, 40.0)):
            self.assertEqual(self.warned(options, bf, depth=numpy.full((2, 3), 10.0), flow=numpy.zeros((2, 3, 2))), [], (options, bf))
        self.assertEqual(self.warned({"depth": depth, "flow": {"epe_px": 1}}, 40.0, flow=numpy.zeros((2, 3, 2))), [])

    def test_a_copy_warns_as_well(self):
        noise = pickle.loads(pickle.dumps(sextant.Noise({"depth": {"delta_d_px": 0.2}})))
        with self.assertWarnsRegex(UserWarning, "for a baseline of 0.5 m"):
            noise.apply(seed=0, dataset="a", sequence="b", frame=0, camera=CAMERA, depth=numpy.full((2, 3), 10.0))

    def test_is_shown(self):
        for options, shown in (({"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 1}}, "depth 0.2 px at a baseline of 0.5 m + flow 1 px"),
                               ({"depth": {"delta_d_px": 0.2, "baseline_m": 0.12}}, "depth 0.2 px at a baseline of 0.12 m"),
                               ({"depth": {"delta_d_px": 0.2, "baseline_m": 0}}, "depth 0.2 px at the source's bf"),
                               ({"quantisation": {"step_px": 0.1, "baseline_m": 0.3}}, "disparity step 0.1 px at b 0.3 m"), ({}, "none")):
            self.assertEqual(repr(sextant.Noise(options)), f"Noise({shown})")
        self.assertEqual(sextant.Noise({"depth": {"delta_d_px": 0.2}}).name, "depth 0.2 px", "the name in records stays")


class Refused(unittest.TestCase):
    """Argument, expected and got are in every message."""

    def refuse(self, *parts, noise=None, **other):
        depth = numpy.full((6, 8), 10, numpy.float32)
        given = {"seed": 0, "dataset": "a", "sequence": "b", "frame": 0, "camera": CAMERA, "depth": depth, **other}
        with self.assertRaises(sextant.Error) as caught:
            sextant.Noise(noise or {"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 1}}).apply(**given)
        for part in parts:
            self.assertIn(part, str(caught.exception))

    def test_other_kinds_of_numbers_are_taken(self):
        depth = numpy.random.default_rng(1).uniform(2, 80, (6, 16)).astype(numpy.float32)[:, ::2]
        noise = sextant.Noise({"depth": {"delta_d_px": 0.2}})
        results = [noise.apply(seed=0, dataset="a", sequence="b", frame=0, camera=CAMERA, depth=other).depth
                   for other in (depth.copy(), depth, depth.astype(float), depth.astype(">f4"), depth.tolist(), numpy.asfortranarray(depth))]
        for other in results[1:]:
            numpy.testing.assert_array_equal(other, results[0])
        self.assertEqual(results[0].dtype, numpy.float32)

    def test_type_shape_and_layout(self):
        good, flow = numpy.full((6, 8), 10, numpy.float32), numpy.zeros((6, 8, 2), numpy.float32)
        self.refuse("depth", "expected numbers", "got complex64", depth=good.astype(complex).astype("c8"))
        self.refuse("depth", "rows differ", depth=[[1.0], [1.0, 2.0]])
        self.refuse("depth", "without a mask", depth=numpy.ma.masked_less(good, 5))
        self.refuse("depth", "got inf", depth=1e300 * good.astype(float))
        self.refuse("depth", "(height, width)", "got shape (1, 6, 8)", depth=good[None])
        self.refuse("depth", "got shape (0, 8)", depth=good[:0])
        self.refuse("flow", "(6, 8, 2), as depth has it", "got shape (6, 7, 2)", flow=numpy.ascontiguousarray(flow[:, :7]))
        self.refuse("flow", "got shape (6, 8)", flow=flow[..., 0])
        self.refuse("mask", "from 0 to 65535", "got -1", mask=numpy.full((6, 8), -1, numpy.int32))
        self.refuse("mask", "whole numbers", "got float64", mask=numpy.zeros((6, 8)).tolist())
        self.refuse("mask", "whole numbers", "got float32", mask=numpy.zeros((6, 8), numpy.float32))
        self.refuse("mask", "rows differ", mask=[[1], [1, 2]])
        self.refuse("mask", "got bool", mask=numpy.zeros((6, 8), bool))
        self.refuse("mask", "65535", "got 70000", mask=numpy.full((6, 8), 70000, numpy.uint32))
        self.refuse("mask", "with a mask", mask=numpy.ma.masked_equal(numpy.zeros((6, 8), numpy.uint16), 0))

    def test_values(self):
        def with_(value):
            depth = numpy.full((6, 8), 10, numpy.float32)
            depth[3, 4] = value
            return depth
        self.refuse("depth", "above 0 m", "got -1 at [3, 4]", depth=with_(-1))
        self.refuse("depth", "above 0 m", "got -1 at [3, 4]", depth=with_(-1), missing="keep")
        self.refuse("depth", "got -inf at [3, 4]", depth=with_(-numpy.inf), missing="keep")
        self.refuse("depth", "finite", "got nan at [3, 4]", "missing='keep'", depth=with_(numpy.nan))
        self.refuse("depth", "got inf at [3, 4]", depth=with_(numpy.inf))
        self.refuse("depth", "got 0 at [3, 4]", depth=with_(0))
        flow = numpy.zeros((6, 8, 2), numpy.float32)
        flow[5, 7, 1] = numpy.nan
        self.refuse("flow", "finite", "got nan at [5, 7, 1]", flow=flow)
        self.refuse("backward_flow", "got nan at [5, 7, 1]", backward_flow=flow)

    def test_the_rest(self):
        self.refuse("seed", "got -1", seed=-1)
        self.refuse("seed", "whole number", "got 1.0", seed=1.0)
        self.refuse("frame", "got -1", frame=-1)
        self.refuse("dataset", "text", "got 3", dataset=3)
        self.refuse("camera", "sextant.Camera", "got None", camera=None)
        self.refuse("camera.fx", "finite", "nan", camera=sextant.Camera(float("nan"), 1, 1, 1, 1))
        self.refuse("camera fx=1e-320", "from 1e-06", camera=sextant.Camera(1e-320, 1, 1, 1, 1))
        self.refuse("camera fx=1e-320", depth=None, flow=numpy.zeros((6, 8, 2), numpy.float32), camera=sextant.Camera(1e-320, 1, 1, 1, 1))
        self.refuse("dataset", "lone surrogate '\\ud800' at character 2", dataset="a\ud800")
        self.refuse("missing", "error, keep", "got 'no'", missing="no")
        self.refuse("at least one array", depth=None, camera=None)
        self.refuse("no mask", noise={"flow": {"bodies": {"objects": {"epe_px": 1}}}}, depth=None,
                    flow=numpy.zeros((6, 8, 2), numpy.float32))
        deep = {}
        for _ in range(100_000):
            deep = {"depth": deep}
        for bad, message in ((deep, "100 levels"), ('{"depth": ' * 1000, "100 levels"), ('"\ud800"', "lone surrogate"),
                          ({"\ud800": 1}, "JSON"), ({"dept": {}}, "did you mean 'depth'"), ({"depth": {"delta_d_px": -1}}, "delta_d_px"),
                          ({"depth": {"delta_d_px": float("nan")}}, "JSON"), ("{", "JSON"), (3, "dict or JSON")):
            with self.assertRaises(sextant.Error) as caught:
                sextant.Noise(bad)
            self.assertIn(message, str(caught.exception))


if __name__ == "__main__":
    unittest.main()
