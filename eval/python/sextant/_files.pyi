# Readers of files; use sextant.read_trajectory, read_flow and read_depth.
import typing

import numpy

Series = typing.Tuple[numpy.ndarray, typing.Optional[numpy.ndarray], typing.Optional[numpy.ndarray], bool]

def trajectory(path: str, format: str) -> typing.Tuple[Series, typing.Optional[Series], typing.List[str], str]: ...
def flow(path: str, format: str) -> numpy.ndarray: ...
def depth(path: str, format: str, bf: float) -> numpy.ndarray: ...
