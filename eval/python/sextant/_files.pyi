# Readers of files, and the evaluation of paths; use sextant.read_trajectory, read_flow, read_depth and evaluate_trajectory.
import typing

import numpy

Series = typing.Tuple[numpy.ndarray, typing.Optional[numpy.ndarray], typing.Optional[numpy.ndarray], bool]

def trajectory(path: str, format: str) -> typing.Tuple[Series, typing.Optional[Series], typing.List[str], str]: ...
def evaluate(estimate: Series, reference: Series, alignment: str, n_to_align: int, up: typing.Optional[typing.Sequence[float]],
             relation: str, delta: typing.Optional[str], all_pairs: bool, max_difference: float, offset: float,
             max_speed: float) -> typing.Tuple[numpy.ndarray, typing.Optional[numpy.ndarray], numpy.ndarray, numpy.ndarray,
                                               typing.List[str]]: ...
def flow(path: str, format: str) -> numpy.ndarray: ...
def depth(path: str, format: str, bf: float) -> numpy.ndarray: ...
