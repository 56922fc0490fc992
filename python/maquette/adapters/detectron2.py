"""Dense pose in the colours of detectron2's DensePose, which image generators were trained on.

    from maquette.adapters.detectron2 import visualize
    hint = visualize(result)                               # ControlNet models: parts in Parula on black
    hint = visualize(result, colours="magicanimate")       # MagicAnimate: parts in Viridis on (68, 1, 84)
    shown = visualize(result, "u", image=rgb, opacity=0.7) # what `apply_net.py show ... dp_u` draws

Part I has the colour at I * 255 / 24 of OpenCV's map, and U and V the colour at U * 255 and V * 255, as
DensePoseDataRelative and MatrixVisualizer have them.
"""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING

import numpy as np

from maquette.densepose import DensePoseResult
from maquette.frames import ImageLike, as_frame

if TYPE_CHECKING:
    from typing import Literal


def visualize(
    result: DensePoseResult,
    show: Literal["parts", "u", "v"] = "parts",
    colours: Literal["detectron2", "magicanimate"] = "detectron2",
    image: ImageLike | None = None,
    opacity: float = 1.0,
) -> np.ndarray:
    """uint8 [H, W, 3] RGB. show: the parts ("dp_segm" of detectron2), or U or V. image: under the people; None: the
    ground that models with these colours expect."""
    values = {"parts": result.part.astype(np.uint16) * 85 // 8, "u": result.u, "v": result.v}
    if show not in values or colours not in MAPS:
        raise ValueError(f"show is one of {', '.join(values)}, and colours one of {', '.join(MAPS)}")
    table = MAPS[colours]
    if image is not None:
        out = np.array(as_frame(image).pixels())
    else:
        out = np.tile(table[0] if colours == "magicanimate" else np.zeros(3, np.uint8), (*result.part.shape, 1))
    body = result.part > 0
    out[body] = out[body] * (1 - opacity) + table[values[show][body]] * opacity
    return out


# RGB at 0 to 255 of COLORMAP_PARULA and COLORMAP_VIRIDIS (OpenCV, Apache-2.0).
MAPS = {
    name: np.frombuffer(base64.b64decode(colours), np.uint8).reshape(256, 3)
    for name, colours in {
        "detectron2": (
            "NSqHMyyKMi6NMC+PLzGSLTOVLDWYKjebKDieJzqgJTyjJD6mIj+pIUGsH0OvHUWxHEe0Gki3GUq6F0y9Fk6/FFDCElHFEVPID1XLDlfO"
            "DFjQC1rTCVzWCF7ZBmDcBGHfA2PhBGThBGXgBWbgBWffBmjfBmrfB2veB2zeCG3dCG7dCW/cCXDcCnHcC3LbC3PbDHTaDHXaDXbaDXfZ"
            "DnjZDnrYD3vYD3zYEH3XEH7XEX/WEYDWEoHWE4LVE4PVFITUFIXUE4bTE4fTE4jTEorSEovSEYzREY3REI7QEI/QD5DQD5HPD5LPDpPO"
            "DpTODZXNDZbNDJfMDJjMDJrMC5vLC5zLCp3KCp7KCZ/JCaDJCKHICKLICKPIB6THB6XHBqbGB6fGCKjECqjDC6nCDanBDqq/EKu+Equ9"
            "E6y7Fay6Fq25GK24Ga62G6+1Ha+0HrCzILCxIbGwI7GvJLKuJrOsKLOrKbSqK7SpLLWnLrWmL7alMbakM7eiNLihNrigN7mfObmdPLmc"
            "P7mbQrqZRbqYSLqXSrqVTbqUULuTU7uRVruQWLuOW7uNXryMYbyKZLyJZ7yIabyGbLyFb72Ecr2Cdb2BeL2Aer1+fb59gL58g756hr55"
            "iL54i792jr91kb90k79ylr9ymL9xmr5wnL5vn75uob5to75spb5rp71qqr1prL1orr1osL1ns71mtb1lt7xkubxju7xivrxhwLxgwrxf"
            "xLtex7teybtdy7tczbtb0Lta0rtZ1LpY1rpX2LpW2rpV27tU3LxT3bxR3r1Q375P4L5O4r9M479L5MBK5cFJ5sFH58JG6MNF6cND6sRC"
            "68VB7MVA7sY+78Y98Mc88cg78sg588k49Mo39co29ss098sz+cwy+s0x+80v/M4u/M8t/NEs/NIr/NMq/NUp+9Yo+9gn+9km+9sl+9wk"
            "+90j+98i++Ah++Ig++Mf++Qe+uYd+ucc+ukb+uoa+usZ+u0Y+u4X+vAW+vEV+vMU+fQT+fUS+fcR+fgQ+foP+fsO"
        ),
        "magicanimate": (
            "RAFURAJWRQRXRQVZRgdaRghcRgpdRgteRw1gRw5hRxBjRxFkRxNlSBRnSBZoSBdpSBhqSBpsSBttSBxuSB1vSB9wSCBxSCFzSCN0SCR1"
            "SCV2SCZ3SCh4SCl5Ryp6Ryx6Ry17Ry58Ry99RjB+RjJ+RjN/RjSARTWBRTeBRTiCRDmDRDqDRDuEQz2EQz6FQj+FQkCGQkGGQUKHQUSH"
            "QEWIQEaIP0eIP0iJPkmJPkqJPkyKPU2KPU6KPE+KPFCLO1GLO1KLOlOLOlSMOVWMOVaMOFiMOFmMN1qMN1uNNlyNNl2NNV6NNV+NNGCN"
            "NGGNM2KNM2ONMmSOMmWOMWaOMWeOMWiOMGmOMGqOL2uOL2yOLm2OLm6OLm+OLXCOLXGOLHGOLHKOLHOOK3SOK3WOKnaOKneOKniOKXmO"
            "KXqOKXuOKHyOKH2OJ36OJ3+OJ4COJoGOJoKOJoKOJYOOJYSOJYWOJIaOJIeOI4iOI4mOI4qNIouNIoyNIo2NIY6NIY+NIZCNIZGMIJKM"
            "IJKMIJOMH5SMH5WLH5aLH5eLH5iLH5mKH5qKHpuKHpyJHp2JH56JH5+IH6CIH6GIH6GHH6KHIKOGIKSGIaWFIaaFIqeFIqiEI6mDJKqD"
            "JauCJayCJq2BJ62BKK6AKa9/KrB/LLF+LbJ9LrN8L7R8MbV7MrZ6NLZ5Nbd5N7h4OLl3Orp2O7t1Pbx0P7xzQL1yQr5xRL9wRsBvSMFu"
            "SsFtTMJsTsNrUMRqUsVpVMVoVsZnWMdlWshkXMhjXsliYMpgY8tfZcteZ8xcac1bbM1abs5YcM9Xc9BWddBUd9FTetFRfNJQf9NOgdNN"
            "hNRLhtVJidVIi9ZGjtZFkNdDk9dBldhAmNg+m9k8ndk7oNo5oto3pds2qNs0qtwyrdwwsN0vst0ttd4ruN4put4ovd8mwN8lwt8jxeAh"
            "yOAgyuEfzeEd0OEc0uIb1eIa2OIZ2uMZ3eMY3+MY4uQY5eQZ5+QZ6uUa7OUb7+Uc8eUd9OYe9uYg+OYh++cj/ecl"
        ),
    }.items()
}
