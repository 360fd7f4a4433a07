"""What an FBX says of itself, and which of its nodes are taken out."""

from __future__ import annotations

import struct

import pytest

from mocapdb.io.blender.fbx_header import MAGIC, FbxHeader, read_fbx_header, without_pictures

TEXT = """; FBX 7.3.0 project file
GlobalSettings:  {
	Properties70:  {
		P: "UpAxis", "int", "Integer", "",2
		P: "OriginalUnitScaleFactor", "double", "Number", "",7
		P: "UnitScaleFactor", "double", "Number", "",2.54
	}
}
Objects:  {
	Texture: 7, "Texture::wood", "" {
		FileName: "//host/share/wood.png"
	}
	Video: 8, "Video::wood", "Clip" {
	}
	Geometry: 9, "Geometry::", "Mesh" {
		LayerElementTexture: 0 {
		}
	}
}
"""


def text(value):
    data = value.encode() if isinstance(value, str) else value
    return b"S" + struct.pack("<I", len(data)) + data


def number(value):
    return (
        b"I" + struct.pack("<i", value)
        if isinstance(value, int)
        else b"D" + struct.pack("<d", value)
    )


def node(name, properties=b"", count=0, children=(), *, wide=False):
    """A node of a binary FBX whose end is counted from its start; `file` puts it in its place."""

    def at(place):
        head = 25 if wide else 13
        inside = place + head + len(name) + len(properties)
        body = b""
        for child in children:
            body += child(inside + len(body))
        if children:
            body += bytes(head)
        end = inside + len(body)
        counts = struct.pack("<QQQ" if wide else "<III", end, count, len(properties))
        return counts + bytes([len(name)]) + name + properties + body

    return at


def setting(key, value, **kind):
    return node(b"P", text(key) + text("") + text("") + text("") + number(value), 5, **kind)


def binary(version=7400, unit=1.0, up=1):
    kind = {"wide": version >= 7500}
    settings = node(
        b"GlobalSettings",
        children=[
            node(
                b"Properties70",
                children=[setting("UpAxis", up, **kind), setting("UnitScaleFactor", unit, **kind)],
                **kind,
            )
        ],
        **kind,
    )
    name = node(b"FileName", text("wood.png"), 1, **kind)
    objects = node(
        b"Objects",
        children=[
            node(b"Model", text("hips"), 1, **kind),
            node(b"Texture", text("wood"), 1, [name], **kind),
            node(b"Video", text("wood"), 1, **kind),
        ],
        **kind,
    )  # fmt: skip
    data = MAGIC + b"\x1a\x00" + struct.pack("<I", version)
    for top in (settings, objects):
        data += top(len(data))
    return data + bytes(25)


@pytest.mark.parametrize("version", [7400, 7500])
def test_binary_files(version):
    assert read_fbx_header(binary(version, 2.54, 2)) == FbxHeader(pytest.approx(0.0254), "z")
    assert read_fbx_header(binary(version)) == FbxHeader(0.01, "y")


def test_text_files():
    assert read_fbx_header(TEXT.encode()) == FbxHeader(pytest.approx(0.0254), "z")
    old = TEXT.replace("Properties70", "Properties60").replace("P: ", "Property: ")
    assert read_fbx_header(old.encode()) == FbxHeader(pytest.approx(0.0254), "z")


def test_nothing_is_said():
    assert read_fbx_header(b"") == FbxHeader(None, None)
    assert read_fbx_header(binary(unit=-1.0, up=7)) == FbxHeader(None, None)


def test_broken_files_say_what_comes_before():
    data = binary(unit=100.0)
    for end in range(0, len(data), 7):
        assert read_fbx_header(data[:end]).unit_m in {None, 1.0}
        without_pictures(data[:end])


@pytest.mark.parametrize("version", [7400, 7500])
def test_pictures_are_left_out_of_binary_files(version):
    data = binary(version)
    cleaned = without_pictures(data)
    assert cleaned is not None and len(cleaned) == len(data)
    assert b"Xexture" in cleaned and b"Xideo" in cleaned
    assert b"Texture" not in cleaned and b"Model" in cleaned
    assert without_pictures(cleaned) is None


def test_pictures_are_left_out_of_text_files():
    cleaned = without_pictures(TEXT.encode())
    assert cleaned is not None
    assert b"\tLeftTexture: 7" in cleaned and b"\tLeftVideo: 8" in cleaned
    assert b"\t\tLayerElementTexture: 0" in cleaned
    assert without_pictures(b"; FBX 7.3.0 project file\n") is None
