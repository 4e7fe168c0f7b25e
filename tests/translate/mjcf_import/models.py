"""Small MJCF files, and places of public ones."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

PUBLIC = Path(os.environ.get("OSIMLITE_PUBLIC_MODELS", "/nonexistent"))
"""Folder with clones of public repositories: ``myo_sim`` (MyoHub/myo_sim), ``mujoco`` (google-deepmind/mujoco)."""

MECHANISM = """
<mujoco model="mechanism">
  <compiler angle="radian"/>
  <default>
    <joint damping="0.3"/>
    <default class="stiff"><joint stiffness="5" springref="0.2" damping="0.7"/></default>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <site name="origin" pos="0 0 1"/>
    <body name="trunk" pos="0 0 1" euler="0 1.5707963267948966 0.3">
      <freejoint name="root"/>
      <geom name="trunk" type="box" size=".1 .2 .3"/>
      <site name="imu" pos="0.1 0 0.05"/>
      <body name="upper arm" pos=".1 .2 .3" euler=".1 .2 .3">
        <joint name="shift" type="slide" axis="1 2 3" range="-.1 .2" ref=".05" limited="true"/>
        <joint name="lift" axis="0 1 0" pos=".01 .02 0" ref=".3" range="-1 2" limited="true" armature=".02"/>
        <joint name="turn" axis="1 0 0" pos=".01 .02 0" class="stiff"/>
        <geom name="upper" type="capsule" size=".04" fromto="0 0 0 0 0 -.3"/>
        <body name="forearm" pos="0 0 -.3">
          <joint name="bend" axis="0 1 0"/>
          <joint name="slip" type="slide" axis="0 0 1" range="0 .1" limited="true" frictionloss=".1"/>
          <joint name="twist" axis="0 0 1" pos="0 .03 0"/>
          <geom type="cylinder" size=".03 .1" pos="0 0 -.1"/>
          <body name="hand" pos="0 0 -.25" quat=".7 .1 .2 .3">
            <joint name="wrist" type="ball" pos="0 0 .01" damping="0"/>
            <geom type="ellipsoid" size=".02 .04 .06" pos="0 0 -.05"/>
          </body>
        </body>
      </body>
    </body>
    <body name="ghost" mocap="true" pos="1 0 0"><geom type="sphere" size=".05" contype="0" conaffinity="0"/></body>
  </worldbody>
  <sensor><accelerometer site="imu"/></sensor>
  <keyframe>
    <key name="high" qpos="0 0 2 1 0 0 0  .1 .5 .2 .3 .02 .1  1 0 0 0"/>
  </keyframe>
</mujoco>
"""

LOOPS = """
<mujoco model="loops">
  <compiler angle="radian"/>
  <default><geom type="capsule" size=".02" fromto="0 0 0 .3 0 0" contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="a" pos="0 0 1"><joint name="ja" axis="0 1 0" ref=".1"/><geom/>
      <body name="b" pos=".3 0 0"><joint name="jb" axis="0 1 0" ref="-.2"/><geom/>
        <body name="c" pos=".3 0 0"><joint name="jc" axis="0 1 0"/><geom/></body></body></body>
    <body name="d" pos="0 .2 1"><freejoint name="fd"/><geom/></body>
    <body name="e" pos="0 .4 1" euler="0 0 .4"><freejoint name="fe"/><geom/></body>
  </worldbody>
  <equality>
    <joint name="couple" joint1="jb" joint2="ja" polycoef=".1 .5 -.3 .2 .05"/>
    <joint name="hold" joint1="jc" polycoef=".25 0 0 0 0"/>
    <weld name="weld" body1="c" body2="d" relpose=".1 .2 .3 .9 .1 .2 .1" anchor=".05 0 .02"/>
    <connect name="connect" body1="d" body2="e" anchor=".3 0 0" active="false"/>
  </equality>
</mujoco>
"""


def write_mjcf(folder: Path, text: str, name: str = "model.xml") -> Path:
    """Write a file, and return its path."""
    path = folder / name
    path.write_text(text)
    return path


def public(name: str) -> Path:
    """Return the path of a public model; skip the test where it is missing."""
    path = PUBLIC / name
    if not path.is_file():
        pytest.skip(
            f"needs {name} in the folder OSIMLITE_PUBLIC_MODELS (clones of MyoHub/myo_sim and "
            "google-deepmind/mujoco)"
        )
    return path
