#!/usr/bin/env python3
"""Tests of scripts/fetch: each data set against a server on this machine, with small archives made here.

usage: scripts/maintain/fetch_test.py [TEST...]
"""

import collections
import fcntl
import functools
import hashlib
import http.client
import http.server
import io
import os
import pathlib
import pty
import re
import resource
import runpy
import shutil
import signal
import socket
import ssl
import stat
import struct
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
import types
import unittest
import urllib.error
import urllib.request
import zipfile
import zlib

HANGS_S = 1200  # ends a script that hangs; nothing waits for a clock
SCRIPTS = pathlib.Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(SCRIPTS))
from fetch_data_sets import DATA_SETS  # noqa: E402

DEMO = DATA_SETS["demo"]().parts[0].archive


PROGRAM = types.SimpleNamespace(**runpy.run_path(str(SCRIPTS / "fetch")))


@functools.cache
def noise(count):
    """Bytes that do not compress, the same in every run."""
    blocks = (hashlib.sha256(str(i).encode()).digest() for i in range(count // 32 + 1))
    return b"".join(blocks)[:count]


def tar(files, mode="w", links=()):
    data = io.BytesIO()
    with tarfile.open(fileobj=data, mode=mode) as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
        for name, target in links:
            member = tarfile.TarInfo(name)
            member.type = tarfile.SYMTYPE
            member.linkname = target
            archive.addfile(member)
    return data.getvalue()


def zip_of(files):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return data.getvalue()


def zip_with_link(name, target, host, external, asi):
    """A zip of a file and of a link that a header of the system `host` declares: in its attributes, in an ASi extra field,
    or in both."""
    data = io.BytesIO()
    mode = stat.S_IFLNK | 0o777
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("training/oxts/0003.txt", "3")
        member = zipfile.ZipInfo(name)
        member.create_system = host
        member.external_attr = mode << 16 if external else 0
        if asi:
            body = struct.pack("<HIHH", mode, len(target), 0, 0) + target.encode()
            member.extra = struct.pack("<HHI", 0x756E, len(body) + 4, zlib.crc32(body)) + body
        archive.writestr(member, target)
    return data.getvalue()


Request = collections.namedtuple("Request", "method name range")


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.files = {}
        self.requests = []
        self.ranges = True  # answer Range requests
        self.sizes = True  # say Content-Length
        self.cut_after = []  # bytes after which the next GETs are cut
        self.stall_after = None  # bytes after which a GET stops sending
        self.status = {}  # name -> status instead of the file
        self.claimed_size = {}  # name -> Content-Length of HEAD
        self.head = True  # answer HEAD
        self.released = threading.Event()

    def gets(self, name=None):
        return [r for r in self.requests if r.method == "GET" and (name is None or r.name == name)]


class Handler(http.server.BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def do_HEAD(self):
        self.answer("HEAD")

    def do_GET(self):
        self.answer("GET")

    def answer(self, method):
        server, name = self.server, self.path.rsplit("/", 1)[-1]
        server.requests.append(Request(method, name, self.headers.get("Range")))
        if name in server.status or name not in server.files or (method == "HEAD" and not server.head):
            self.send_error(server.status.get(name, 404 if server.head else 405))
            return
        content = server.files[name]
        size, start = len(content), 0
        wanted = re.fullmatch(r"bytes=(\d+)-", self.headers.get("Range", ""))
        if wanted and server.ranges:
            start = int(wanted.group(1))
            if start >= size:
                self.send_response(416)
                self.send_header("Content-Range", f"bytes */{size}")
                self.send_header("Content-Length", "0")
                self.end_headers()
                return
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {start}-{size - 1}/{size}")
        else:
            self.send_response(200)
        if server.sizes:
            claimed = server.claimed_size.get(name, size - start) if method == "HEAD" else size - start
            self.send_header("Content-Length", str(claimed))
        self.send_header("ETag", f'"{hashlib.md5(content).hexdigest()}"')
        self.end_headers()
        if method == "GET":
            self.send_content(content[start:])

    def send_content(self, content):
        server = self.server
        if server.stall_after is not None:
            self.wfile.write(content[: server.stall_after])
            self.wfile.flush()
            server.released.wait(30)
        elif server.cut_after:
            self.wfile.write(content[: server.cut_after.pop(0)])
        else:
            self.wfile.write(content)


def vkitti1_archives():
    files = {}
    for world in ("0001", "0018"):
        for variation in ("clone", "15-deg-left"):
            for kind in ("rgb", "depthgt", "flowgt", "scenegt"):
                for frame in range(2):
                    path = f"vkitti_1.3.1_{kind}/{world}/{variation}/{frame:05d}.png"
                    files.setdefault(kind, {})[path] = f"{kind} {world} {variation} {frame}".encode() + noise(40000)
            name = f"{world}_{variation}"
            files["scenegt"][f"vkitti_1.3.1_scenegt/{name}_scenegt_rgb_encoding.txt"] = b"Category(:id) r g b\n"
            files.setdefault("extrinsicsgt", {})[f"vkitti_1.3.1_extrinsicsgt/{name}.txt"] = name.encode()
            files.setdefault("motgt", {})[f"vkitti_1.3.1_motgt/{name}.txt"] = name.encode()
    text = ("extrinsicsgt", "motgt")
    return {
        f"vkitti_1.3.1_{kind}.tar" + (".gz" if kind in text else ""): tar(members, "w:gz" if kind in text else "w")
        for kind, members in files.items()
    }


def vkitti2_archives():
    kinds = ("rgb", "depth", "forwardFlow", "backwardFlow", "instanceSegmentation")
    archives = {}
    for kind in kinds:
        members = {}
        for scene in ("Scene01", "Scene18"):
            for camera in (0, 1):
                members[f"{scene}/clone/frames/{kind}/Camera_{camera}/x_00000.png"] = f"{kind} {scene}".encode()
        archives[f"vkitti_2.0.3_{kind}.tar"] = tar(members)
    names = ("intrinsic", "extrinsic", "pose", "bbox", "info", "colors")
    members = {f"./{s}/clone/{n}.txt": n.encode() for s in ("Scene01", "Scene18") for n in names}
    archives["vkitti_2.0.3_textgt.tar.gz"] = tar(members, "w:gz")
    return archives


def kitti_archives():
    archives = {}
    for archive, folder in (("calib", "calib"), ("oxts", "oxts"), ("label_2", "label_02")):
        members = {f"training/{folder}/{s}.txt": f"{folder} {s}" for s in ("0003", "0005")}
        members.update({f"testing/{folder}/0003.txt": "test"})
        archives[f"data_tracking_{archive}.zip"] = zip_of(members)
    for camera in (2, 3):
        members = {f"training/image_0{camera}/{s}/{f:06d}.png": s for s in ("0003", "0005") for f in range(2)}
        members[f"testing/image_0{camera}/0003/000000.png"] = "test"
        archives[f"data_tracking_image_{camera}.zip"] = zip_of(members)
    archives["instances_txt.zip"] = zip_of({f"instances_txt/{s}.txt": s for s in ("0003", "0005")})
    archives["instances.zip"] = zip_of({f"instances/{s}/000000.png": s for s in ("0003", "0005")})
    return archives


def demo_archive(without=""):
    top = DEMO.removesuffix(".tar.gz")
    members = {f"{top}/README.md": b"code", f"{top}/src/Tracking.cc": b"code"}
    for name in ("image_0/000000.png", "depth/000000.png", "flow/000000.flo", "semantic/000000.txt", "pose_gt.txt",
                 "object_pose.txt", "times.txt", "kitti03.yaml"):
        if not without or not name.startswith(without):
            members[f"{top}/kitti_sample/{name}"] = name.encode()
    return tar(members, "w:gz")


@functools.cache
def published_archives():
    return {**vkitti1_archives(), **vkitti2_archives(), **kitti_archives(), DEMO: demo_archive()}


class FetchTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="sextant_fetch_"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.out = self.folder / "data set"  # a space, as paths may have one
        self.pins = self.folder / "pins.txt"
        self.pins.write_text("# none\n\n")
        self.server = Server()
        self.server.files = dict(published_archives())
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.server.released.set)
        self.mirror = f"http://127.0.0.1:{self.server.server_address[1]}/sub"

    def environment(self, **more):
        kept = {k: v for k, v in os.environ.items() if not k.startswith("SEXTANT_") and not k.lower().endswith("_proxy")}
        return {**kept, "SEXTANT_FETCH_WAIT": "0", "SEXTANT_FETCH_ATTEMPTS": "3", **more}

    def command(self, data_set, *arguments, accept=True, mirror=None):
        command = [str(SCRIPTS / "fetch"), data_set, "--out", str(self.out), "--mirror", mirror or self.mirror]
        command += ["--checksums", str(self.pins)] + (["--accept-license"] if accept else [])
        return command + list(arguments)

    def fetch(self, data_set, *arguments, code=0, accept=True, mirror=None, **environment):
        done = subprocess.run(self.command(data_set, *arguments, accept=accept, mirror=mirror), text=True, timeout=HANGS_S,
                              stdin=subprocess.DEVNULL, capture_output=True, env=self.environment(**environment))
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def tree(self):
        """Files in the output folder, without the state of scripts/fetch."""
        return sorted(str(p.relative_to(self.out)) for p in self.out.rglob("*")
                      if p.is_file() and ".fetch" not in p.relative_to(self.out).parts)

    def leftovers(self):
        return sorted(p.name for p in (self.out / ".fetch").iterdir() if not p.name.endswith(".done"))

    # ---- what is unpacked, per script

    def test_vkitti1_everything(self):
        text = self.fetch("vkitti1", "--all")
        self.assertEqual(len(self.tree()), 4 * 4 * 2 + 3 * 4)
        self.assertTrue((self.out / "vkitti_1.3.1_motgt/0018_15-deg-left.txt").is_file())
        image = self.out / "vkitti_1.3.1_depthgt/0018/clone/00001.png"
        self.assertEqual(image.read_bytes(), b"depthgt 0018 clone 1" + noise(40000))
        self.assertIn("CC BY-NC-SA 3.0", text)
        self.assertIn(f"vkitti1:{self.out}#0018/clone", text)
        self.assertIn(hashlib.sha256(self.server.files["vkitti_1.3.1_rgb.tar"]).hexdigest(), text)
        self.assertEqual(self.leftovers(), ["lock"])

    def test_vkitti1_text_only_is_the_default_and_asks_for_text_only(self):
        for arguments in (["--text-only"], []):
            shutil.rmtree(self.out, ignore_errors=True)
            self.server.requests.clear()
            self.fetch("vkitti1", *arguments)
            self.assertEqual({r.name for r in self.server.requests},
                             {"vkitti_1.3.1_extrinsicsgt.tar.gz", "vkitti_1.3.1_motgt.tar.gz"})
            self.assertEqual(len(self.tree()), 8)

    def test_vkitti1_sequences(self):
        self.fetch("vkitti1", "--masks", "--objects", "--sequences", "0018/clone")
        self.assertEqual(self.tree(), [
            "vkitti_1.3.1_motgt/0018_clone.txt", "vkitti_1.3.1_scenegt/0018/clone/00000.png",
            "vkitti_1.3.1_scenegt/0018/clone/00001.png", "vkitti_1.3.1_scenegt/0018_clone_scenegt_rgb_encoding.txt"])
        self.fetch("vkitti1", "--masks", "--objects", "--sequences", "0001")
        self.assertEqual(len(self.tree()), 4 + 2 + 2 * 2 + 2)
        self.server.requests.clear()
        self.fetch("vkitti1", "--masks", "--objects", "--sequences", "0018/clone,0001/clone")
        self.assertEqual(self.server.requests, [])
        self.assertIn("holds nothing of 0020", self.fetch("vkitti1", "--masks", "--sequences", "0020", code=5))

    def test_vkitti2(self):
        text = self.fetch("vkitti2", "--all")
        self.assertEqual(len(self.tree()), 5 * 2 * 2 + 2 * 6)
        self.assertTrue((self.out / "Scene18/clone/frames/forwardFlow/Camera_1/x_00000.png").is_file())
        self.assertTrue((self.out / "Scene18/clone/extrinsic.txt").is_file())
        self.assertIn(f"vkitti2:{self.out}#Scene18/clone", text)

    def test_vkitti2_accepts_a_folder_above_the_scenes(self):
        self.server.files["vkitti_2.0.3_rgb.tar"] = tar({"vkitti_2.0.3_rgb/Scene01/clone/frames/rgb/Camera_0/a": b"a"})
        self.fetch("vkitti2", "--rgb")
        self.assertEqual(self.tree(), ["Scene01/clone/frames/rgb/Camera_0/a"])

    def test_kitti_everything_but_the_test_set(self):
        text = self.fetch("kitti_tracking", "--all")
        self.assertIn("oxts: unpack 18B", text)  # two files of 9 bytes, not that of testing/
        folders = {"/".join(name.split("/")[:2]) for name in self.tree()}
        self.assertEqual(folders, {f"training/{f}" for f in (
            "image_02", "image_03", "calib", "oxts", "label_02", "instances_txt", "instances")})
        self.assertIn(f"kitti:{self.out}#0003", text)

    def test_kitti_sequences(self):
        self.fetch("kitti_tracking", "--text-only", "--left", "--sequences", "0003")
        self.assertEqual(self.tree(), [f"training/{f}" for f in (
            "calib/0003.txt", "image_02/0003/000000.png", "image_02/0003/000001.png", "instances_txt/0003.txt",
            "label_02/0003.txt", "oxts/0003.txt")])

    def test_kitti_masks_without_a_folder(self):
        self.server.files["instances_txt.zip"] = zip_of({"0003.txt": "a", "0005.txt": "b"})
        self.fetch("kitti_tracking", "--masks")
        self.assertEqual(self.tree(), ["training/instances_txt/0003.txt", "training/instances_txt/0005.txt"])
        self.assertEqual((self.out / "training/instances_txt").stat().st_mode & 0o500, 0o500)

    def test_sceneflow2015(self):
        self.server.files["data_scene_flow_calib.zip"] = zip_of({"training/calib_cam_to_cam/000002.txt": "c"})
        self.server.files["data_scene_flow.zip"] = zip_of({"training/image_2/000002_10.png": "i",
                                                           "testing/image_2/000002_10.png": "t"})
        self.fetch("sceneflow2015", "--all")
        self.assertEqual(self.tree(), ["training/calib_cam_to_cam/000002.txt", "training/image_2/000002_10.png"])

    def test_demo(self):
        self.server.sizes = False  # as the real server, which makes its archives while sending
        text = self.fetch("demo")
        self.assertEqual(self.tree(), ["depth/000000.png", "flow/000000.flo", "image_0/000000.png", "kitti03.yaml",
                                       "object_pose.txt", "pose_gt.txt", "semantic/000000.txt", "times.txt"])
        self.assertIn("does not say the size", text)
        self.assertIn(f"vdo:{self.out}", text)

    def test_demo_without_a_channel_is_refused(self):
        self.server.files[DEMO] = demo_archive(without="flow")
        self.assertIn("has no flow", self.fetch("demo", code=5))
        self.assertEqual(self.tree(), [])

    # ---- resuming

    def test_second_run_downloads_nothing(self):
        self.fetch("vkitti1", "--rgb")
        self.server.requests.clear()
        self.assertIn("already in", self.fetch("vkitti1", "--rgb", accept=False))
        self.assertEqual(self.server.requests, [])
        shutil.rmtree(self.out / "vkitti_1.3.1_rgb")  # gone: is fetched again
        self.fetch("vkitti1", "--rgb")
        self.assertEqual(len(self.tree()), 8)

    def test_cut_connection_is_resumed_in_the_same_run(self):
        self.server.cut_after = [100000]
        self.fetch("vkitti1", "--rgb")
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_cut_connection_is_resumed_by_the_next_run(self):
        self.server.cut_after = [100000]
        text = self.fetch("vkitti1", "--rgb", code=4, SEXTANT_FETCH_ATTEMPTS="1")
        self.assertIn("was cut", text)
        self.assertEqual((self.out / ".fetch/vkitti_1.3.1_rgb.tar.part").stat().st_size, 100000)
        self.assertEqual(self.tree(), [])
        self.fetch("vkitti1", "--rgb")
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_server_without_ranges(self):
        self.server.ranges = False
        self.server.cut_after = [100000]
        self.assertIn("start again", self.fetch("vkitti1", "--rgb"))
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_file_that_changed_on_the_server_is_not_resumed(self):
        self.server.cut_after = [100000]
        self.fetch("vkitti1", "--rgb", code=4, SEXTANT_FETCH_ATTEMPTS="1")
        self.server.files["vkitti_1.3.1_rgb.tar"] = tar({"vkitti_1.3.1_rgb/0001/clone/00000.png": noise(300000)})
        self.assertIn("has changed", self.fetch("vkitti1", "--rgb"))
        self.assertEqual([r.range for r in self.server.gets()], [None, None])
        self.assertEqual((self.out / "vkitti_1.3.1_rgb/0001/clone/00000.png").read_bytes(), noise(300000))

    def test_interrupt_leaves_what_the_next_run_needs(self):
        self.server.stall_after = 100000
        process = subprocess.Popen(self.command("vkitti1", "--rgb"), stdin=subprocess.DEVNULL, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=self.environment())
        part = self.out / ".fetch/vkitti_1.3.1_rgb.tar.part"
        deadline = time.monotonic() + HANGS_S
        while not (part.exists() and part.stat().st_size > 0) and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output = "".join(process.communicate(timeout=HANGS_S))
        self.assertEqual(process.returncode, 130, output)
        self.assertIn("interrupted", output)
        kept = part.stat().st_size
        self.assertGreater(kept, 0)
        self.assertEqual(self.tree(), [])
        self.server.stall_after = None
        self.fetch("vkitti1", "--rgb")
        self.assertEqual(self.server.gets()[-1].range, f"bytes={kept}-")
        self.assertEqual(len(self.tree()), 8)
        self.assertEqual(self.leftovers(), ["lock"])

    def test_interrupt_while_unpacking_leaves_no_half_folder(self):
        hangs = ("import runpy, shutil, sys, time; copy, count = shutil.copyfileobj, []\n"
                 "def slow(*words):\n    copy(*words); words[1].flush(); count.append(1)\n"
                 "    if len(count) == 8: time.sleep(6000)\n"
                 "shutil.copyfileobj, sys.path[0:1] = slow, sys.argv[1:2]\n"
                 "sys.argv = [sys.argv[1] + '/fetch', *sys.argv[2:]]; runpy.run_path(sys.argv[0], run_name='__main__')")
        command = self.command("vkitti1", "--rgb")
        process = subprocess.Popen([sys.executable, "-c", hangs, str(SCRIPTS), *command[1:]], text=True,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   env=self.environment())
        deadline = time.monotonic() + HANGS_S
        while len(list(self.out.glob(".fetch/unpack.*/files/**/*.png"))) < 8 and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output = "".join(process.communicate(timeout=HANGS_S))
        self.assertEqual(process.returncode, 130, output)
        self.assertEqual(self.tree(), [])
        self.assertEqual(list(self.out.glob(".fetch/unpack.*")), [])
        self.server.requests.clear()
        self.fetch("vkitti1", "--rgb")
        self.assertEqual(self.server.requests, [])  # the archive was whole
        self.assertEqual(len(self.tree()), 8)

    # ---- what is refused

    def test_checksums(self):
        content = self.server.files["vkitti_1.3.1_rgb.tar"]
        sums = {"md5": hashlib.md5(content).hexdigest(), "sha256": hashlib.sha256(content).hexdigest()}
        for algorithm, right in sums.items():
            wrong = "0" * len(right)
            self.pins.write_text(f"{algorithm} {wrong} vkitti_1.3.1_rgb.tar\n")
            text = self.fetch("vkitti1", "--rgb", code=5)
            self.assertIn(f"{algorithm} sum {right}", text)
            self.assertEqual(self.tree(), [])
            self.assertTrue((self.out / ".fetch/vkitti_1.3.1_rgb.tar.rejected").is_file())
        self.pins.write_text("".join(f"{a} {s} vkitti_1.3.1_rgb.tar\n" for a, s in sums.items()))
        self.fetch("vkitti1", "--rgb")
        self.assertEqual(len(self.tree()), 8)

    def test_malformed_checksums(self):
        self.pins.write_text("# sums\nmd5 12 vkitti_1.3.1_rgb.tar\n")
        self.assertIn("pins.txt:2: expected", self.fetch("vkitti1", "--rgb", code=2))

    def test_own_checksums_are_well_formed(self):
        archives = {part.archive for make in DATA_SETS.values() for part in make().parts}
        for line in (SCRIPTS / "fetch_checksums.txt").read_text().splitlines():
            if line and not line.startswith("#"):
                self.assertRegex(line, r"^(md5 [0-9a-f]{32}|sha256 [0-9a-f]{64}) [^ ]+$")
                self.assertIn(line.split()[2], archives)

    def test_truncated_archives(self):
        whole = published_archives()
        for script, part, name in (("vkitti1", "--rgb", "vkitti_1.3.1_rgb.tar"),
                                   ("vkitti1", "--objects", "vkitti_1.3.1_motgt.tar.gz"),
                                   ("kitti_tracking", "--oxts", "data_tracking_oxts.zip")):
            with self.subTest(name):
                self.server.files[name] = whole[name][: len(whole[name]) * 2 // 3]
                self.assertIn("truncated or no archive", self.fetch(script, part, code=5))
                self.assertEqual(self.tree(), [])
                self.server.files[name] = whole[name]
                self.fetch(script, part)
                self.assertNotEqual(self.tree(), [])
                shutil.rmtree(self.out)

    def test_damaged_zip(self):
        content = bytearray(zip_of({"training/oxts/0003.txt": noise(1000)}))
        content[500] ^= 1
        self.server.files["data_tracking_oxts.zip"] = bytes(content)
        self.assertIn("truncated or no archive", self.fetch("kitti_tracking", "--oxts", code=5))

    def test_page_instead_of_an_archive(self):
        for script, part, name in (("vkitti1", "--rgb", "vkitti_1.3.1_rgb.tar"),
                                   ("kitti_tracking", "--oxts", "data_tracking_oxts.zip")):
            self.server.files[name] = b"<html>please log in</html>\n" * 100
            self.assertIn("no archive at all", self.fetch(script, part, code=5))

    def test_unsafe_members(self):
        good = {"vkitti_1.3.1_rgb/0001/clone/00000.png": b"x"}
        for name, archive in {
            "../evil": tar({**good, "../evil": b"e"}),
            "vkitti_1.3.1_rgb/../../evil": tar({**good, "vkitti_1.3.1_rgb/../../evil": b"e"}),
            "/tmp/evil": tar({**good, "/tmp/evil": b"e"}),
            "vkitti_1.3.1_rgb/link": tar(good, links=[("vkitti_1.3.1_rgb/link", "/tmp")]),
        }.items():
            with self.subTest(name):
                self.server.files["vkitti_1.3.1_rgb.tar"] = archive
                self.assertIn(f"unsafe member: {name}", self.fetch("vkitti1", "--rgb", code=5))
                self.assertEqual(self.tree(), [])
        self.server.files["data_tracking_oxts.zip"] = zip_of({"training/oxts/0003.txt": "x", "../evil": "e"})
        self.assertIn("unsafe member: ../evil", self.fetch("kitti_tracking", "--oxts", code=5))
        self.assertEqual(list(self.folder.rglob("evil")), [])

    def test_links_of_any_system_in_a_zip(self):
        foreign = self.folder / "foreign"
        foreign.mkdir()
        (foreign / "mine.txt").write_text("mine")
        archives = self.folder / "archives"
        archives.mkdir()
        for host in range(20):  # MS-DOS, OpenVMS, Unix, .. Darwin
            for external, asi in ((True, False), (False, True), (True, True)) if host in (0, 2, 3) else ((True, True),):
                with self.subTest(host=host, external=external, asi=asi):
                    (archives / "data_tracking_oxts.zip").write_bytes(
                        zip_with_link("training/oxts/0005.txt", str(foreign), host, external, asi))
                    done = subprocess.run(self.command("kitti_tracking", "--oxts", "--archives", str(archives)), text=True,
                                          timeout=HANGS_S, stdin=subprocess.DEVNULL, capture_output=True, env=self.environment())
                    self.assertEqual(done.returncode, 5, done.stdout + done.stderr)
                    self.assertIn("unsafe member: training/oxts/0005.txt", done.stderr)
                    self.assertEqual(self.tree(), [])
                    self.assertEqual([p for p in self.out.rglob("*") if p.is_symlink()], [])
                    self.assertEqual((foreign / "mine.txt").read_text(), "mine")
                    shutil.rmtree(self.out)

    def test_nothing_is_placed_through_a_link(self):
        foreign = self.folder / "foreign"
        for script, part, link in (("kitti_tracking", "--masks", "training"), ("kitti_tracking", "--oxts", "training"),
                                   ("vkitti1", "--rgb", "vkitti_1.3.1_rgb"), ("kitti_tracking", "--oxts", ".fetch")):
            with self.subTest(part=part, link=link):
                foreign.mkdir()
                self.out.mkdir()
                (self.out / link).symlink_to(foreign)
                done = subprocess.run(self.command(script, part), text=True, timeout=HANGS_S, stdin=subprocess.DEVNULL,
                                      capture_output=True, env=self.environment())
                self.assertNotEqual(done.returncode, 0, done.stdout)
                self.assertEqual(list(foreign.iterdir()), [])
                shutil.rmtree(self.out)
                foreign.rmdir()

    def test_other_layout(self):
        self.server.files["vkitti_1.3.1_rgb.tar"] = tar({"0001/clone/00000.png": b"x"})
        self.assertIn("holds nothing of Virtual KITTI", self.fetch("vkitti1", "--rgb", code=5))

    def test_missing_file(self):
        del self.server.files["vkitti_1.3.1_rgb.tar"]
        text = self.fetch("vkitti1", "--rgb", code=4)
        self.assertIn("HTTP status 404 (no such file)", text)
        self.assertIn("/sub/vkitti_1.3.1_rgb.tar", text)
        self.assertEqual(len(self.server.requests), 1)  # trying again cannot help

    def test_failing_server_is_tried_again(self):
        self.server.status["vkitti_1.3.1_rgb.tar"] = 503
        text = self.fetch("vkitti1", "--rgb", code=4)
        self.assertIn("HTTP status 503", text)
        self.assertIn("gave up after 3 attempts", text)

    def test_server_without_head(self):
        self.server.head = False
        self.server.cut_after = [100000]
        self.fetch("vkitti1", "--rgb")
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_one_run_at_a_time(self):
        (self.out / ".fetch").mkdir(parents=True)
        with open(self.out / ".fetch/lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.assertIn("another", self.fetch("vkitti1", "--objects", code=2))
        self.fetch("vkitti1", "--objects")

    def test_no_network(self):
        self.assertIn("is there a network", self.fetch("vkitti1", "--rgb", code=4, mirror="http://127.0.0.1:9"))

    def test_errors_are_explained(self):
        def status(code):
            return urllib.error.HTTPError("ADDRESS", code, "", {}, None)

        for error, words, again in ((urllib.error.URLError(socket.gaierror(-2, "unknown")), "is not known", True),
                                    (urllib.error.URLError(ConnectionRefusedError(111, "no")), "a network", True),
                                    (TimeoutError(), "in time", True), (ConnectionResetError(), "was cut", True),
                                    (http.client.IncompleteRead(b""), "was cut", True),
                                    (urllib.error.URLError(ssl.SSLError(1, "x")), "ca-certificates", False),
                                    (status(403), "no permission", False), (status(404), "no such file", False),
                                    (status(500), "status 500", True), (status(429), "status 429", True)):
            why, can_help = PROGRAM.explain(error, "ADDRESS")
            self.assertIn(words, why)
            self.assertEqual(can_help, again, why)

    def test_encryption_is_never_left(self):
        request = urllib.request.Request("https://a.example/x", method="HEAD")
        with self.assertRaises(PROGRAM.Failure):
            PROGRAM.Redirects().redirect_request(request, None, 302, "", {}, "http://a.example/x")
        followed = PROGRAM.Redirects().redirect_request(request, None, 302, "", {}, "https://b.example/x")
        self.assertEqual((followed.full_url, followed.get_method()), ("https://b.example/x", "HEAD"))

    def test_full_disk(self):
        done = subprocess.run(self.command("vkitti1", "--rgb"), stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              env=self.environment(), timeout=HANGS_S,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000)))
        self.assertEqual(done.returncode, 6, done.stdout + done.stderr)
        self.assertIn("is the disk full", done.stderr)
        self.assertEqual(self.tree(), [])

    def test_no_space(self):
        self.server.claimed_size["vkitti_1.3.1_rgb.tar"] = 10**17
        text = self.fetch("vkitti1", "--rgb", code=6)
        self.assertRegex(text, r"the download needs 100PB, and .* has .*B free")
        self.assertEqual(self.server.gets(), [])

    def test_licence_is_shown_and_asked_for(self):
        text = self.fetch("vkitti1", "--objects", code=3, accept=False)
        for words in ("CC BY-NC-SA 3.0", "https://", "Non-commercial", "CVPR 2016", "--accept-license"):
            self.assertIn(words, text)
        self.assertEqual(self.server.requests, [])
        self.assertFalse(self.out.exists())

    def test_licence_is_accepted_by_an_answer(self):
        for answer, code, count in (("no", 3, 0), ("yes", 0, 4)):
            terminal, child_side = pty.openpty()
            process = subprocess.Popen(self.command("vkitti1", "--objects", accept=False), stdin=child_side,
                                       text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                       env=self.environment())
            os.write(terminal, f"{answer}\n".encode())
            output = process.communicate(timeout=HANGS_S)[0]
            os.close(terminal)
            os.close(child_side)
            self.assertEqual(process.returncode, code, output)
            self.assertEqual(len(self.tree()) if self.out.exists() else 0, count)

    def test_usage_errors(self):
        for arguments, words in ((["--thermal"], "unrecognized arguments: --thermal"), (["rgb"], "unrecognized arguments: rgb"),
                                 (["--sequences", "0007"], "'0007' is none of"), (["--out"], "argument --out: expected one argument"),
                                 (["--mirror", "ftp://x"], "expected an http:// or https:// address"),
                                 (["--sequences", "../0001"], "is none of"),
                                 (["--checksums", "/nowhere"], "no such file")):
            with self.subTest(arguments):
                self.assertIn(words, self.fetch("vkitti1", *arguments, code=2))
        self.assertIn("unrecognized arguments: --sequences", self.fetch("demo", "--sequences", "0003", code=2))
        self.assertEqual(self.server.requests, [])

    def test_needs_no_other_tool(self):
        done = subprocess.run([sys.executable, *self.command("kitti_tracking", "--oxts")], text=True, timeout=HANGS_S,
                              stdin=subprocess.DEVNULL, capture_output=True, env=self.environment(PATH="/nowhere"))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(len(self.tree()), 2)

    def test_archives_that_were_downloaded_before(self):
        archives = self.folder / "archives"
        archives.mkdir()
        (archives / "data_tracking_oxts.zip").write_bytes(kitti_archives()["data_tracking_oxts.zip"])
        self.fetch("kitti_tracking", "--oxts", "--archives", str(archives))
        self.assertEqual(self.tree(), ["training/oxts/0003.txt", "training/oxts/0005.txt"])
        self.assertEqual(self.server.requests, [])
        self.assertTrue((archives / "data_tracking_oxts.zip").is_file())

    def test_kept_archive_is_unpacked_again(self):
        self.fetch("kitti_tracking", "--left", "--sequences", "0003", "--keep-archives")
        self.server.requests.clear()
        self.fetch("kitti_tracking", "--left", "--sequences", "0005")
        self.assertEqual(self.server.requests, [])
        self.assertEqual(len(self.tree()), 4)

    def test_list_needs_no_network(self):
        for script in ("vkitti1", "vkitti2", "kitti_tracking", "sceneflow2015", "demo"):
            done = subprocess.run([SCRIPTS / "fetch", script, "--list"], text=True, capture_output=True, env=self.environment())
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(f"scripts/fetch {script}", done.stdout)
            self.assertRegex(done.stdout, r"https://(download\.europe\.naverlabs\.com|s3\.eu-central-1|codeload)")


if __name__ == "__main__":
    unittest.main()
