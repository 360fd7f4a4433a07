"""Motion files: Acclaim (ASF and AMC), BVH and NPZ, read and written; AMASS, glTF, CSV, FBX.

======================  ==============================================================
`clip_files`            `read_clip`, `write_clip` by suffix, `find_skeleton` of an AMC
`reading`               `ReadOptions`: what a user says of files
`folder_settings`       ``mocapdb.toml``: what is said of a folder's files
`acclaim`               ASF and AMC together
`asf`, `amc`            skeletons, and motions, of Acclaim
`bvh`                   a skeleton and its motion in one file
`npz`                   all that a clip holds, exactly
`plain_arrays`          an archive of quaternions, names, parents and bones
`amass`                 motions of SMPL's bodies, as AMASS has them, read and written
`smpl_carrying`         motion of any human body carried over to these
`smpl_bodies`           the joints of these bodies, and how long their bones are
`gltf_reading`          skins that an animation moves, in glTF 2.0
`blender`               FBX, Collada and USD, by way of Blender
`posed_clips`           a clip of where joints are and how they are turned
`csv_tables`            a row a frame, for spreadsheets
`representation_files`  clips in O'Kane's representations, as NPZ and CSV
`conventions`           from Acclaim's convention to BVH's and back
`source_text`           a changed clip in the text of its source
`frame_rates`           the rate that a frame time stands for
`tpose`                 T-poses that some conversions put in front of a motion
`find_files`            the motion files of a folder
`_settings_text`        small TOML files that users write
`_text`                 files as text: encodings, lines, what is mended
`_frame_text`           frames of numbers, fast and exactly
`_bvh_hierarchy`        the first part of a BVH, word by word
`_bvh_motion`           the second: counts, rates and rows
`_asf_text`             skeletons of Acclaim as text
`_file_order`           joints and channels in a file's order
`tuning`                the tuned numbers
======================  ==============================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mocapdb.base.lazy import attach

if TYPE_CHECKING:
    from mocapdb.io.amass import write_smpl as write_smpl
    from mocapdb.io.clip_files import find_skeleton as find_skeleton
    from mocapdb.io.clip_files import read_clip as read_clip
    from mocapdb.io.clip_files import write_clip as write_clip
    from mocapdb.io.csv_tables import write_csv as write_csv
    from mocapdb.io.find_files import find_motion_files as find_motion_files
    from mocapdb.io.folder_settings import FolderSettings as FolderSettings
    from mocapdb.io.folder_settings import read_with_settings as read_with_settings
    from mocapdb.io.reading import ReadOptions as ReadOptions
    from mocapdb.io.reading import read_joint_map as read_joint_map
    from mocapdb.io.representation_files import write_representation as write_representation

__getattr__, __dir__, __all__ = attach(__name__)
