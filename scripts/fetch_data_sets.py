"""The data sets of scripts/fetch: parts, addresses, licences, where their files go, and the options for them."""

import argparse
import dataclasses
import os
import pathlib
import re
import typing

CHECKSUMS = pathlib.Path(__file__).resolve().parent / "fetch_checksums.txt"
VARIATIONS = "(/(clone|fog|morning|overcast|rain|sunset|(15|30)-deg-(left|right)))?"
BY_NC_SA = """Creative Commons Attribution-NonCommercial-ShareAlike 3.0 (CC BY-NC-SA 3.0)
  https://creativecommons.org/licenses/by-nc-sa/3.0/
  Non-commercial use only; share derived data under the same terms; cite:
"""
GAIDON = "A. Gaidon, Q. Wang, Y. Cabon, E. Vig: Virtual Worlds as Proxy for Multi-Object Tracking Analysis, CVPR 2016"
GEIGER = ("A. Geiger, P. Lenz, R. Urtasun: Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite, "
          "CVPR 2012")
REGISTRATION = """
  KITTI asks for a registration: https://www.cvlibs.net/datasets/kitti/user_login.php
  The terms that count: https://www.cvlibs.net/datasets/kitti/"""
REGISTER = ("The KITTI page asks for a registration before it gives its links; please register there. Archives from there "
            "are used by --archives.")


@dataclasses.dataclass(frozen=True)
class Part:
    name: str
    kind: str  # text or image; text parts are fetched if no part is named
    archive: str
    address: str  # of the archive, or with / at its end of the archive's folder
    size: str  # approximate, from public notes; - is unknown
    content: str
    members: typing.Callable  # of a sequence or '': regular expression of members to unpack; its group: their place in DIR/target
    target: str = "."
    required: tuple = ()  # entries ("a|b": either one) that an archive must have to be laid out as the adapter expects

    def place_of(self, name, sequence):
        """Returns where a member of the sequence belongs below DIR, None for others. Folders around the data set do not count."""
        found = re.fullmatch(r"(?!__MACOSX/)(?:.*?/)??" + self.members(sequence), name)
        return f"{self.target}/{found[1]}".removeprefix("./") if found else None

    def url(self, mirror=""):
        if mirror:
            return f"{mirror.rstrip('/')}/{self.archive}"
        return self.address + (self.archive if self.address.endswith("/") else "")


@dataclasses.dataclass(frozen=True)
class DataSet:
    name: str
    title: str
    folder: str  # default name of the output folder
    note: str
    licence: str
    parts: tuple
    hint: str  # what to try next, with {data}, {out}, {sequence}
    pattern: str = ""  # regular expression of an entry of --sequences; empty: the data set has no such option
    sequences: str = ""  # description of these entries for messages
    example: str = ""  # sequence of the hint if none is requested
    variation: str = ""  # appended to a sequence without a variation, for the hint

    def listing(self, mirror=""):
        lines = (f"  {'--' + part.name:<16} {part.kind:<6} {part.size:>9}  {part.content}\n  {'':<16} {part.url(mirror)}"
                 for part in self.parts)
        return "\n".join((f"{self.title}: scripts/fetch {self.name}", *lines))


def hint(*commands):
    return "\n".join(("Try:", "  export SEXTANT_DATA={data}", *(f"  sextant {c}" for c in commands)))


def parts(base, rows, members):
    """Returns the parts of a data set in the folder `base` of its server."""
    return tuple(Part(name, kind, archive, base, size, content, members) for name, kind, archive, size, content in rows)


def vkitti1_members(sequence):
    """<archive>/<world>/<variation>/00000.png and <archive>/<world>_<variation>....txt"""
    of_sequence = rf"(?:{sequence}/.*|{sequence.replace('/', '_')}(?:_.*)?\.txt)" if sequence else ".*"
    return rf"(vkitti_1\.3\.1_[a-z]+/{of_sequence})"


def vkitti1():
    base = "https://download.europe.naverlabs.com/virtual-kitti-1.3.1/"
    page = "https://europe.naverlabs.com/research/computer-vision/proxy-virtual-worlds-vkitti-1/"
    rows = (("extrinsics", "text", "vkitti_1.3.1_extrinsicsgt.tar.gz", "1.1 MB", "camera poses"),
            ("objects", "text", "vkitti_1.3.1_motgt.tar.gz", "-", "object boxes, poses, moving flags"),
            ("rgb", "image", "vkitti_1.3.1_rgb.tar", "14 GB", "colour images"),
            ("depth", "image", "vkitti_1.3.1_depthgt.tar", "5.1 GB", "depth, cm"),
            ("flow", "image", "vkitti_1.3.1_flowgt.tar", "-", "optical flow to the next frame"),
            ("masks", "image", "vkitti_1.3.1_scenegt.tar", "488 MB", "instances as colours, with their tables"))
    return DataSet(
        "vkitti1", "Virtual KITTI 1.3.1", "vkitti_1.3.1", f"For the adapter vkitti1. Home page: {page}",
        f"Virtual KITTI 1.3.1: {BY_NC_SA}  {GAIDON}.\n  The terms that count: {page}",
        parts(base, rows, vkitti1_members),
        hint("data check replay-vkitti1:{out}#{sequence}      # text parts are enough",
             "data check vkitti1:{out}#{sequence}             # with rgb, depth, flow and masks",
             "run vkitti1:{out}#{sequence} --estimator joint_flow --out results/runs/vkitti1"),
        "(0001|0002|0006|0018|0020)" + VARIATIONS,
        "0001, 0002, 0006, 0018, 0020, each with /VARIATION (clone, fog, 15-deg-left, ...) or without", "0018/clone",
        "/clone")


def vkitti2():
    base = "https://download.europe.naverlabs.com/virtual_kitti_2.0.3/"
    page = "https://europe.naverlabs.com/research/computer-vision/proxy-virtual-worlds-vkitti-2/"
    rows = (("text", "text", "vkitti_2.0.3_textgt.tar.gz", "24 MB", "poses, calibration, boxes, track ids"),
            ("rgb", "image", "vkitti_2.0.3_rgb.tar", "7.5 GB", "colour images"),
            ("depth", "image", "vkitti_2.0.3_depth.tar", "8.1 GB", "depth, cm"),
            ("flow", "image", "vkitti_2.0.3_forwardFlow.tar", "31 GB", "optical flow to the next frame"),
            ("backward-flow", "image", "vkitti_2.0.3_backwardFlow.tar", "29 GB", "optical flow to the previous frame"),
            ("masks", "image", "vkitti_2.0.3_instanceSegmentation.tar", "170 MB", "instances"))
    return DataSet(
        "vkitti2", "Virtual KITTI 2.0.3", "vkitti_2.0.3", f"For the adapter vkitti2, both cameras. Home page: {page}",
        f"Virtual KITTI 2: {BY_NC_SA}  Y. Cabon, N. Murray, M. Humenberger: Virtual KITTI 2, arXiv:2001.10773, 2020, and\n"
        f"  {GAIDON}.\n  The terms that count: {page}",
        parts(base, rows, lambda sequence: f"({sequence or 'Scene[0-9]{2}'}/.*)"),
        hint("data check vkitti2:{out}#{sequence}",
             "run vkitti2:{out}#{sequence} --estimator joint_flow --out results/runs/vkitti2   # with the image parts"),
        "Scene(01|02|06|18|20)" + VARIATIONS,
        "Scene01, Scene02, Scene06, Scene18, Scene20, each with /VARIATION (clone, fog, ...) or without", "Scene18/clone",
        "/clone")


def kitti_members(sequence):
    """training/<kind>/<sequence>.txt and training/<kind>/<sequence>/..."""
    return rf"(training/[^/]+/{sequence}(?:\.txt|/.*))" if sequence else "(training/.*)"


def kitti_tracking():
    base = "https://s3.eu-central-1.amazonaws.com/avg-kitti/"
    mots = "https://www.vision.rwth-aachen.de/media/resource_files/"
    page = "https://www.vision.rwth-aachen.de/page/mots"
    rows = (("calib", "text", "data_tracking_calib.zip", "1 MB", "camera calibration"),
            ("oxts", "text", "data_tracking_oxts.zip", "8 MB", "GPS and IMU: true camera poses"),
            ("labels", "text", "data_tracking_label_2.zip", "9 MB", "object boxes and poses"),
            ("left", "image", "data_tracking_image_2.zip", "15.8 GB", "left colour images (with the test set)"),
            ("right", "image", "data_tracking_image_3.zip", "-", "right colour images (with the test set)"))
    any_sequence = "[0-9]{4}"
    masks = (Part("masks", "text", "instances_txt.zip", mots, "4.1 MB", "MOTS masks, run lengths as text",
                  lambda sequence: rf"({sequence or any_sequence}\.txt)", "training/instances_txt"),
             Part("mask-images", "image", "instances.zip", mots, "-", "MOTS masks, PNG",
                  lambda sequence: rf"({sequence or any_sequence}/[^/]+\.png)", "training/instances"))
    return DataSet(
        "kitti_tracking", "KITTI tracking (training) and KITTI MOTS", "kitti_tracking",
        f"For the adapter kitti. Home pages: https://www.cvlibs.net/datasets/kitti/eval_tracking.php, {page}\n{REGISTER}",
        f"KITTI and KITTI MOTS: {BY_NC_SA}  {GEIGER}\n"
        "  P. Voigtlaender et al.: MOTS: Multi-Object Tracking and Segmentation, CVPR 2019 (the masks)"
        f"{REGISTRATION} and {page}",
        parts(base, rows, kitti_members) + masks,
        hint("data check replay-kitti:{out}#{sequence}        # text parts are enough",
             "data check kitti:{out}#{sequence}               # with --left --right",
             "run kitti:{out}#{sequence} --estimator joint_flow --out results/runs/kitti"),
        "00(0[0-9]|1[0-9]|20)", "0000 to 0020", "0003")


def sceneflow2015():
    base = "https://s3.eu-central-1.amazonaws.com/avg-kitti/"
    rows = (("calib", "text", "data_scene_flow_calib.zip", "1.6 MB", "camera calibration"),
            ("images", "image", "data_scene_flow.zip", "1.7 GB", "stereo pairs, flow, disparity (with the test set)"))
    return DataSet(
        "sceneflow2015", "KITTI scene flow 2015 (training)", "kitti_sceneflow_2015",
        f"Home page: https://www.cvlibs.net/datasets/kitti/eval_scene_flow.php\n{REGISTER}",
        f"KITTI: {BY_NC_SA}  M. Menze, A. Geiger: Object Scene Flow for Autonomous Vehicles, CVPR 2015{REGISTRATION}",
        parts(base, rows, kitti_members),
        "In place: {out}/training/{{image_2,image_3,flow_occ,flow_noc,disp_occ_0,disp_noc_0,disp_occ_1,disp_noc_1,"
        "calib_cam_to_cam}}\n"
        "Try:\n  sextant data check sceneflow:{out}#000002      # with --images")


def demo(ref="15ec535739d5e6c075de1db21f70d52419d207d9"):
    return DataSet(
        "demo", "demo of the multimot_track authors", "kitti_03_demo",
        """The sample that the paper's authors publish with their code, for the adapter vdo: the first frames of KITTI
tracking 0003 with disparity, flow, masks and true poses. It is the folder kitti_sample of
https://github.com/halajun/multimot_track; the archive of the repository is downloaded, and only that folder is unpacked.

A longer demo is linked from https://github.com/halajun/VDO_SLAM (section Examples, kitti-demo): it lies on a drive that
needs a browser. Unpacked by hand, it is read as vdo:DIR in the same way.""",
        f"Demo of multimot_track: the repository is under GPLv3; its images and labels are KITTI data, under\n  {BY_NC_SA}"
        "  J. Zhang, M. Henein, R. Mahony, V. Ila: Robust Ego and Object 6-DoF Motion Estimation and Tracking, IROS 2020\n"
        f"  {GEIGER}\n"
        "  The terms that count: https://github.com/halajun/multimot_track and https://www.cvlibs.net/datasets/kitti/",
        (Part("sample", "text", f"multimot_track-{ref}.tar.gz",
              f"https://codeload.github.com/halajun/multimot_track/tar.gz/{ref}", "-",
              "frames of KITTI 0003 with all inputs and truth", lambda sequence: "kitti_sample/(.*)",
              required=("depth", "flow", "semantic", "pose_gt.txt", "object_pose.txt", "image_0|image")),),
        hint("data check vdo:{out}", "run vdo:{out} --estimator joint_flow --out results/runs/demo"))


DATA_SETS = {data_set.name: data_set for data_set in (vkitti1(), vkitti2(), kitti_tracking(), sceneflow2015(), demo())}


def arguments(description):
    """Returns the options of the command line; ends the program with exit code 2 if a value is wrong."""
    common = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    common.add_argument("--list", action="store_true", help="show the parts with their addresses, and stop")
    common.add_argument("--text-only", action="store_true",
                        help="the text parts (the default): true poses, objects and calibration, without images")
    common.add_argument("--all", action="store_true", help="every part")
    common.add_argument("--out", type=pathlib.Path, metavar="DIR", help="where to unpack; default: the data set's "
                        "folder in $SEXTANT_DATA, or in data/ where that is not set")
    common.add_argument("--accept-license", "--accept-licence", action="store_true",
                        help="accept the licence, which is always shown, without being asked")
    common.add_argument("--archives", type=pathlib.Path, metavar="DIR",
                        help="take archives from there that were downloaded before, named as --list shows them")
    common.add_argument("--keep-archives", action="store_true",
                        help="keep downloaded archives in DIR/.fetch, to unpack other sequences later")
    common.add_argument("--mirror", metavar="URL", default=os.environ.get("SEXTANT_MIRROR", ""),
                        help="download ARCHIVE from URL/ARCHIVE; also as SEXTANT_MIRROR")
    common.add_argument("--checksums", type=pathlib.Path, metavar="FILE", default=CHECKSUMS,
                        help="known sums; default scripts/fetch_checksums.txt")
    style = {"allow_abbrev": False, "formatter_class": argparse.RawDescriptionHelpFormatter}
    parser = argparse.ArgumentParser(prog="scripts/fetch", description=description, **style)
    parser.add_argument("--list", action="store_true", help="show the parts of every data set, and stop")
    names = parser.add_subparsers(dest="data_set", metavar="DATA_SET", title="data sets (each has its own --help)")
    for name, data_set in DATA_SETS.items():
        one = names.add_parser(name, parents=[common], help=data_set.title, **style,
                               description=f"Fetches {data_set.title}. {data_set.note}\n\n{data_set.licence}")
        for part in data_set.parts:
            one.add_argument(f"--{part.name}", action="append_const", dest="selected", const=part.name, default=[],
                             help=f"{part.kind} part, {part.size}: {part.content}")
        if data_set.pattern:
            one.add_argument("--sequences", default="", metavar="LIST", help="unpack only these, separated by commas: "
                             f"{data_set.sequences} (the archives are whole: this saves space, not downloading)")
        if name == "demo":
            one.add_argument("--ref", metavar="COMMIT", help="commit, branch or tag to take; default is one whose "
                             "README names the sample; HEAD is the latest")
        one.set_defaults(sequences="", ref="")
    options = parser.parse_args()
    if not options.data_set:
        if not options.list:
            parser.error("expected a data set: " + ", ".join(DATA_SETS))
        return options
    data_set = DATA_SETS[options.data_set]
    options.sequences = [s for s in options.sequences.split(",") if s]
    for sequence in options.sequences:
        if not re.fullmatch(data_set.pattern, sequence):
            parser.error(f"--sequences: '{sequence}' is none of {data_set.title}: expected {data_set.sequences}")
    if options.mirror and not re.match("https?://[^/]", options.mirror):
        parser.error(f"--mirror '{options.mirror}': expected an http:// or https:// address")
    if options.archives and not options.archives.is_dir():
        parser.error(f"--archives '{options.archives}' is not a folder")
    if options.ref and not re.fullmatch(r"[A-Za-z0-9._-]+", options.ref):
        parser.error("--ref needs a commit, branch or tag")
    if not options.checksums.is_file():
        parser.error(f"--checksums '{options.checksums}': no such file")
    return options
