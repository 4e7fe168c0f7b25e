"""Small MJCF files, and paths of public ones."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

PUBLIC = Path(os.environ.get("OSIMLITE_PUBLIC_MODELS", "/nonexistent"))
"""Folder with clones of public repositories: ``myo_sim`` (MyoHub/myo_sim), ``mujoco`` (google-deepmind/mujoco)."""

# Model with joints of all types, springs, dampers and armature.
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

# Model with equality constraints.
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
    """Return the path of a public model; skip the test if the file does not exist."""
    path = PUBLIC / name
    if not path.is_file():
        pytest.skip(
            f"needs {name} in the folder OSIMLITE_PUBLIC_MODELS (clones of MyoHub/myo_sim and "
            "google-deepmind/mujoco)"
        )
    return path


# Model with tendons, muscles and other actuators.
ARM = """
<mujoco model="arm">
  <compiler angle="radian"/>
  <default>
    <geom contype="0" conaffinity="0" density="800"/>
    <site size=".002"/>
    <joint limited="true" damping=".1"/>
    <default class="wrap"><geom type="cylinder" size=".03 .1" group="3" mass="0"/></default>
  </default>
  <worldbody>
    <site name="S0" pos="-.05 0 .9"/><site name="S1" pos=".05 0 .85"/>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" range="-1 1.5"/>
      <joint name="abduction" axis="1 0 0" range="-.6 .6"/>
      <geom type="capsule" size=".03" fromto="0 0 0 0 0 -.3"/>
      <geom name="ball" type="sphere" size=".03" group="3" mass="0"/>
      <geom name="elbow_cylinder" class="wrap" pos="0 0 -.3" euler="1.5707963267948966 0 0" size=".025 .05"/>
      <geom name="sleeve" class="wrap" pos="0 0 -.2" euler="1.5707963267948966 0 0" size=".03 .05"/>
      <site name="U0" pos="-.04 0 -.1"/><site name="U1" pos=".03 0 -.12"/><site name="U2" pos=".04 0 -.27"/>
      <site name="back" pos="-.05 0 -.3"/><site name="front" pos=".06 0 0"/><site name="inside" pos=".01 0 -.2"/>
      <body name="lower" pos="0 0 -.3">
        <joint name="elbow" axis="0 -1 0" range="0 1.6"/>
        <geom type="capsule" size=".025" fromto="0 0 0 0 0 -.25"/>
        <site name="L0" pos="-.02 0 -.06"/><site name="L1" pos=".02 0 -.08"/><site name="L2" pos=".02 .01 -.15"/>
        <body name="slider" pos="0 0 -.25">
          <joint name="reach" type="slide" axis="0 0 -1" range="0 .1"/>
          <geom type="sphere" size=".03"/>
          <site name="tip" pos="0 0 -.03" euler="0 .3 0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="straight"><site site="S1"/><site site="U2"/><site site="L1"/></spatial>
    <spatial name="over"><site site="U0"/><geom geom="elbow_cylinder" sidesite="back"/><site site="L0"/></spatial>
    <spatial name="round"><site site="S1"/><geom geom="ball"/><site site="U1"/><site site="L2"/></spatial>
    <spatial name="through"><site site="U1"/><geom geom="sleeve" sidesite="inside"/><site site="L1"/></spatial>
    <spatial name="pulley"><site site="S1"/><site site="U2"/><pulley divisor="2"/><site site="U2"/><site site="L1"/>
      <pulley divisor="2"/><site site="U1"/><site site="L2"/></spatial>
    <spatial name="elastic" stiffness="200" damping="3" springlength=".1 .2"><site site="S0"/><site site="U0"/></spatial>
    <spatial name="loose"><site site="U0"/><site site="L2"/></spatial>
    <fixed name="both"><joint joint="shoulder" coef=".5"/><joint joint="elbow" coef="-.25"/></fixed>
  </tendon>
  <actuator>
    <muscle name="m_straight" tendon="straight" force="300" lengthrange=".2 .5"/>
    <muscle name="m_over" tendon="over" force="500" lengthrange=".15 .35" lmin=".4" lmax="1.9" vmax="10" fpmax="1.4"
      fvmax="1.4" timeconst=".015 .06" range=".6 1.3"/>
    <muscle name="m_round" tendon="round" force="200" lengthrange=".1 .5" range=".3 1.2"/>
    <muscle name="m_through" tendon="through" force="200" lengthrange=".15 .35"/>
    <muscle name="m_pulley" tendon="pulley" force="200" lengthrange=".2 .6"/>
    <muscle name="m_joint" joint="elbow" gear="-.03" force="100" lengthrange="-.05 .01"/>
    <motor name="motor" joint="shoulder" gear="20" ctrlrange="-1 1"/>
    <position name="servo" joint="elbow" kp="15" kv=".5" ctrlrange="0 2"/>
    <velocity name="speed" joint="abduction" kv="2"/>
    <general name="lag" joint="reach" gainprm="40" dyntype="filterexact" dynprm=".05"/>
    <motor name="pull" tendon="straight" gear="-30" ctrlrange="0 1"/>
    <motor name="linear" tendon="both" gear="4"/>
    <motor name="push" site="tip" gear="0 0 5 0 0 0"/>
    <motor name="twist" site="tip" gear="0 0 0 0 2 0"/>
    <motor name="mixed" site="tip" gear="0 0 1 0 0 1"/>
  </actuator>
</mujoco>
"""


# Model with tendons around geoms with side sites.
SIDES = """
<mujoco>
  <compiler angle="radian"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <site name="a" pos="-.06 0 .05"/><site name="side" pos="0 0 .05"/>
    <geom name="c" type="cylinder" size=".03 .1" euler="1.5707963267948966 0 0"/>
    <body name="b">
      <joint name="j" axis="0 1 0" range="-.5 2.5" limited="true"/><geom type="sphere" size=".01" pos=".05 0 .02"/>
      <site name="b" pos=".06 0 .01"/>
    </body>
  </worldbody>
  <tendon><spatial name="t"><site site="a"/><geom geom="c" sidesite="side"/><site site="b"/></spatial></tendon>
  <actuator><muscle name="m" tendon="t" force="10" lengthrange=".05 .2"/></actuator>
</mujoco>
"""
