"""Small motion files for the tests, written by hand."""

ASF = """\
# a comment of bytes
:version 1.10
:name body
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   anything: 1 2 3 # really
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name hip
     direction 0.6 -0.8 0
     length 2.5
     axis 0 0 0  XYZ
  end
  begin
     id 2
     name thigh
     direction 0.34202 -0.939693 0
     length 7.5
     axis 0 0 20  XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 3
     name shin
     direction 0.34202 -0.939693 0
     length 7
     axis 0 0 20  XYZ
    dof rx
  end
  begin
     id 4
     name foot
     direction 0 0 1
     length 2
     axis -90 10 20  XYZ
    dof rx rz
  end
  begin
     id 5
     name spine
     direction 0 1 0
     length 12
     axis 0 0 0 XYZ
    dof rz ry rx
  end
:hierarchy
  begin
    root hip spine
    hip thigh
    thigh shin
    shin foot
  end
"""

AMC = """\
#!OML:ASF X:\\somewhere
:FULLY-SPECIFIED
:DEGREES
1
root 1 2 3 10 20 30
thigh 1.5 -2.5 3.5
shin 40
foot 5 -6
spine 1 2 3
2
root 1.25 2 3 11 21 31
thigh 2.5 -2.5 4.5
shin 41
foot 6 -6.6742e-014
spine .5 1. +3
"""

BVH = """\
HIERARCHY
ROOT Hips
{
\tOFFSET 0 0 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
\tJOINT Left Leg
\t{
\t\tOFFSET 4 0 0
\t\tCHANNELS 3 Zrotation Xrotation Yrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 -90 0
\t\t}
\t}
\tJOINT Head
\t{
\t\tOFFSET 0 60 0
\t\tCHANNELS 3 Yrotation Zrotation Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 20 0
\t\t}
\t}
}
MOTION
Frames: 3
Frame Time: .0083333
0 90 0 1 2 3 4 5 6 7 8 9
1 90 0 2 3 4 5 6 7 8 9 10
2 90 0 3 4 5 6 7 8 9 10 11.5
"""


def line_of(part, text):
    """The 1-based line that holds the first appearance of a part of a text; None for None."""
    return None if part is None else text[: text.index(part)].count("\n") + 1
