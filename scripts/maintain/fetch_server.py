"""A server for fetch_test.py, with small archives of the members that each data set publishes."""

import hashlib
import http.server
import io
import itertools
import re
import stat
import struct
import tarfile
import threading
import zipfile
import zlib

from fetch_data_sets import DATA_SETS

NOISE = b"".join(hashlib.sha256(str(i).encode()).digest() for i in range(1250))  # does not compress, the same in every run
RGB, OXTS, DEMO = "vkitti_1.3.1_rgb.tar", "data_tracking_oxts.zip", DATA_SETS["demo"].parts[0].archive
LINK_MODE = stat.S_IFLNK | 0o777


def packed(archive_name, members, *links):
    """Returns the bytes of an archive, whose kind follows from its name. The content of a member is its name, in tar archives
    followed by noise."""
    data = io.BytesIO()
    if archive_name.endswith(".zip"):
        with zipfile.ZipFile(data, "w") as archive:
            for name, content in (*zip(members, members), *links):
                archive.writestr(name, content)
        return data.getvalue()
    with tarfile.open(fileobj=data, mode="w:gz" if archive_name.endswith(".gz") else "w") as archive:
        for name, target in (*((name, None) for name in members), *links):
            member = tarfile.TarInfo(name)
            if target:
                member.type, member.linkname = tarfile.SYMTYPE, target
            else:
                member.size = len(name) + len(NOISE)
            archive.addfile(member, io.BytesIO(name.encode() + NOISE))
    return data.getvalue()


def zip_link(name, target, host, external, asi):
    """A link in a zip that a header of the system `host` declares: in its attributes, in an ASi extra field, or in both."""
    member = zipfile.ZipInfo(name)
    member.create_system = host
    member.external_attr = LINK_MODE << 16 if external else 0
    if asi:
        body = struct.pack("<HIHH", LINK_MODE, len(target), 0, 0) + target.encode()
        member.extra = struct.pack("<HHI", 0x756E, len(body) + 4, zlib.crc32(body)) + body
    return member, target


def names(*patterns):
    """Returns the names that patterns such as `(0003|0005).txt` stand for, sorted."""
    choices = ([part.split("|") for part in re.split(r"[()]", pattern)] for pattern in patterns)
    return sorted("".join(words) for choice in choices for words in itertools.product(*choice))


# Members of archives as they are published.
WORLDS, SCENES, DEMO_TOP = "(0001|0018)", "(Scene01|Scene18)", DEMO.removesuffix(".tar.gz")
VKITTI1_IMAGES = f"{WORLDS}/(clone|15-deg-left)/0000(0|1).png"
DEMO_FILES = ("(depth|image_0)/000000.png", "flow/000000.flo", "semantic/000000.txt", "(pose_gt|object_pose|times).txt", "kitti03.yaml")
PUBLISHED = {
    **{f"vkitti_1.3.1_{kind}.tar": names(f"vkitti_1.3.1_{kind}/{VKITTI1_IMAGES}") for kind in ("rgb", "depthgt", "flowgt")},
    "vkitti_1.3.1_scenegt.tar": names(f"vkitti_1.3.1_scenegt/{VKITTI1_IMAGES}",
                                      f"vkitti_1.3.1_scenegt/{WORLDS}_(clone|15-deg-left)_scenegt_rgb_encoding.txt"),
    **{f"vkitti_1.3.1_{kind}.tar.gz": names(f"vkitti_1.3.1_{kind}/{WORLDS}_(clone|15-deg-left).txt")
       for kind in ("extrinsicsgt", "motgt")},
    **{f"vkitti_2.0.3_{kind}.tar": names(f"{SCENES}/clone/frames/{kind}/Camera_(0|1)/x_00000.png")
       for kind in ("rgb", "depth", "forwardFlow", "backwardFlow", "instanceSegmentation")},
    "vkitti_2.0.3_textgt.tar.gz": names(f"./{SCENES}/clone/(intrinsic|extrinsic|pose|bbox|info|colors).txt"),
    **{f"data_tracking_{kind}.zip": names(f"training/{folder}/(0003|0005).txt", f"testing/{folder}/0003.txt")
       for kind, folder in (("calib", "calib"), ("oxts", "oxts"), ("label_2", "label_02"))},
    **{f"data_tracking_image_{camera}.zip": names(f"training/image_0{camera}/(0003|0005)/00000(0|1).png",
                                                  f"testing/image_0{camera}/0003/000000.png") for camera in (2, 3)},
    "instances_txt.zip": names("instances_txt/(0003|0005).txt"),
    "instances.zip": names("instances/(0003|0005)/000000.png"),
    "data_scene_flow_calib.zip": ["training/calib_cam_to_cam/000002.txt"],
    "data_scene_flow.zip": names("(training|testing)/image_2/000002_10.png"),
    DEMO: names(f"{DEMO_TOP}/README.md", f"{DEMO_TOP}/src/Tracking.cc", *(f"{DEMO_TOP}/kitti_sample/{name}" for name in DEMO_FILES)),
}
ARCHIVES = {archive: packed(archive, members) for archive, members in PUBLISHED.items()}


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    ranges = True  # answer Range requests
    sizes = True  # say Content-Length
    stall_after = None  # bytes after which a GET stops sending

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.files = dict(ARCHIVES)
        self.requests = []  # (name, range)
        self.cut_after = []  # bytes after which the next GETs are cut
        self.status = {}  # name -> status instead of the file
        self.claimed_size = {}  # name -> Content-Length instead of the true one
        self.released = threading.Event()


class Handler(http.server.BaseHTTPRequestHandler):
    def log_message(self, *_):
        pass

    def do_GET(self):
        server, name = self.server, self.path.rsplit("/", 1)[-1]
        server.requests.append((name, self.headers.get("Range")))
        if name in server.status or name not in server.files:
            self.send_error(server.status.get(name, 404))
            return
        content = server.files[name]
        tag = f'"{hashlib.md5(content).hexdigest()}"'
        takes_range = server.ranges and self.headers.get("If-Range") == tag
        wanted = re.fullmatch(r"bytes=(\d+)-", self.headers.get("Range", "")) if takes_range else None
        start, length = int(wanted[1]) if wanted else 0, len(content)
        beyond = start >= length
        self.send_response(416 if beyond else 206 if wanted else 200)
        if wanted:
            self.send_header("Content-Range", f"bytes {'*' if beyond else f'{start}-{length - 1}'}/{length}")
        content = content[start:]
        if server.sizes:
            self.send_header("Content-Length", str(server.claimed_size.get(name, len(content))))
        self.send_header("ETag", tag)
        self.end_headers()
        cut = server.cut_after.pop(0) if server.cut_after else server.stall_after
        self.wfile.write(content[:cut])
        if server.stall_after is not None:
            self.wfile.flush()
            server.released.wait(30)
