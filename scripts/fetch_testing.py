"""What fetch_test.py stands on: the server, the archives, and running a script."""

import functools
import hashlib
import http.server
import io
import os
import pathlib
import re
import shutil
import stat
import struct
import subprocess
import tarfile
import tempfile
import threading
import unittest
import zipfile
import zlib

HANGS_S = 1200  # ends a script that hangs; nothing waits for a clock
SCRIPTS = pathlib.Path(__file__).resolve().parent
DEMO_REF = re.search(r"^ref=(\w+)$", (SCRIPTS / "fetch_demo").read_text(), re.M).group(1)
DEMO = f"multimot_track-{DEMO_REF}.tar.gz"


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


class Request:
    def __init__(self, method, name, range_header):
        self.method, self.name, self.range = method, name, range_header


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
    top = f"multimot_track-{DEMO_REF}"
    members = {f"{top}/README.md": b"code", f"{top}/src/Tracking.cc": b"code"}
    for name in ("image_0/000000.png", "depth/000000.png", "flow/000000.flo", "semantic/000000.txt", "pose_gt.txt",
                 "object_pose.txt", "times.txt", "kitti03.yaml"):
        if not without or not name.startswith(without):
            members[f"{top}/kitti_sample/{name}"] = name.encode()
    return tar(members, "w:gz")


class FetchCase(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="sextant_fetch_"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.out = self.folder / "data set"  # a space, as paths may have one
        self.pins = self.folder / "pins.txt"
        self.pins.write_text("# none\n\n")
        self.server = Server()
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.server.released.set)
        self.mirror = f"http://127.0.0.1:{self.server.server_address[1]}/sub"

    def environment(self, **more):
        kept = {k: v for k, v in os.environ.items() if not k.startswith("SEXTANT_") and not k.lower().endswith("_proxy")}
        return {**kept, "SEXTANT_FETCH_WAIT": "0", "SEXTANT_FETCH_ATTEMPTS": "3", **more}

    def command(self, script, *arguments, accept=True, mirror=None):
        command = [str(SCRIPTS / script), "--out", str(self.out), "--mirror", mirror or self.mirror]
        command += ["--checksums", str(self.pins)] + (["--accept-license"] if accept else [])
        return command + list(arguments)

    def fetch(self, script, *arguments, code=0, accept=True, mirror=None, **environment):
        done = subprocess.run(self.command(script, *arguments, accept=accept, mirror=mirror), text=True, timeout=HANGS_S,
                              stdin=subprocess.DEVNULL, capture_output=True, env=self.environment(**environment))
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def tree(self):
        """Files in the output folder, without the state of the scripts."""
        return sorted(str(p.relative_to(self.out)) for p in self.out.rglob("*")
                      if p.is_file() and ".fetch" not in p.relative_to(self.out).parts)

    def leftovers(self):
        return sorted(p.name for p in (self.out / ".fetch").iterdir() if not p.name.endswith(".done"))
