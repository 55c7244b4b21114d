"""A robot that is nobody's: heavier, smaller wheels further apart, round as balls."""

OWN_ROBOT = """<mujoco model="porter">
  <compiler angle="radian"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1"/>
    <body name="base">
      <joint name="base_x" type="slide" axis="1 0 0"/>
      <joint name="base_y" type="slide" axis="0 1 0"/>
      <joint name="base_yaw" type="hinge" axis="0 0 1"/>
      <site name="footprint" size="0.12"/>
      <geom name="hull" type="box" pos="0 0 0.1" size="0.06 0.06 0.05" mass="13"
            contype="0" conaffinity="0"/>
      <body name="axle_left" pos="0 0.088 0.03">
        <joint type="slide" axis="0 0 1" stiffness="400" damping="60" springref="-0.2"/>
        <joint name="wheel_left" axis="0 1 0"/>
        <geom name="wheel_left" type="sphere" size="0.03" mass="0.4" contype="0"
              conaffinity="0"/>
      </body>
      <body name="axle_right" pos="0 -0.088 0.03">
        <joint type="slide" axis="0 0 1" stiffness="400" damping="60" springref="-0.2"/>
        <joint name="wheel_right" axis="0 1 0"/>
        <geom name="wheel_right" type="sphere" size="0.03" mass="0.4" contype="0"
              conaffinity="0"/>
      </body>
      <body name="bumper">
        <joint name="bumper_x" type="slide" axis="1 0 0" stiffness="4000"
               damping="120"/>
        <joint name="bumper_y" type="slide" axis="0 1 0" stiffness="4000"
               damping="120"/>
        <geom name="bumper" type="cylinder" pos="0 0 0.1" size="0.12 0.08" mass="0.8"
              contype="2" conaffinity="2" priority="2" friction="0.1"/>
      </body>
    </body>
  </worldbody>
  <contact>
    <pair geom1="floor" geom2="wheel_left" friction="0.9 0.9 0 0 0" solref="0.004 1"
          solimp="0.99 0.999 0.001"/>
    <pair geom1="wheel_right" geom2="floor" friction="0.9 0.9 0 0 0" solref="0.004 1"
          solimp="0.99 0.999 0.001"/>
  </contact>
  <actuator>
    <velocity name="drive_left" joint="wheel_left" kv="1" forcerange="-0.75 0.75"/>
    <velocity name="drive_right" joint="wheel_right" kv="1" forcerange="-0.75 0.75"/>
  </actuator>
</mujoco>
"""
