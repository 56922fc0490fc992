"""The exported graphs compute what the torch network computes, at any size; the manifest describes them."""

import hashlib
import json

import numpy as np
import onnx
import pytest
import torch
from rectangle_people import write_shard

from export.bundle import BundleInfo
from export.densepose import bundle, export_onnx, graphs, targets
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.decode import Graphs
from export.densepose.network import MobileParsingRCNN

WIDTH = 16
pytestmark = pytest.mark.usefixtures("one_thread")


def lively_network(seed):
    """An untrained network whose normalisation and fusion do something."""
    torch.manual_seed(seed)
    net = MobileParsingRCNN(NetworkConfig(width=WIDTH, evidence=4, keypoints=33))
    torch.nn.init.normal_(net.evidence.out.weight)
    for module in net.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.uniform_(-0.2, 0.2)
            module.running_var.uniform_(0.5, 1.5)
            torch.nn.init.uniform_(module.weight, 0.7, 1.3)
            torch.nn.init.uniform_(module.bias, -0.2, 0.2)
    for fusion in net.neck.fuse.values():
        torch.nn.init.uniform_(fusion.weight, -0.5, 1.5)
    return net.eval()


@pytest.fixture(scope="module")
def net():
    return lively_network(0)


@pytest.fixture(scope="module")
def crop_net():
    return lively_network(1)


@pytest.fixture(scope="module")
def full_folder(net, crop_net, tmp_path_factory):
    """A bundle whose crop pass has networks of its own."""
    folder = tmp_path_factory.mktemp("full")
    export_onnx.export_graphs(net, folder, crop_net)
    bundle.write_manifest(folder, BundleInfo("full", "fp32"), net.config, DecodeConfig(), crops=True)
    return folder


@pytest.fixture(scope="module")
def folder(net, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle")
    export_onnx.export_graphs(net, folder)
    bundle.write_manifest(folder, BundleInfo("tiny", "fp32"), net.config, DecodeConfig())
    return folder


def run(folder, graph, *given):
    session = export_onnx.session(folder / f"{graph}.onnx")
    names = [value.name for value in session.get_inputs()]
    return session.run(None, {name: tensor.numpy() for name, tensor in zip(names, given, strict=True)})


def assert_close(expected, found):
    for tensor, array in zip(expected, found, strict=True):
        assert tuple(tensor.shape) == array.shape
        scale = float(tensor.abs().max())
        assert scale > 0
        assert np.abs(tensor.numpy() - array).max() <= export_onnx.TOLERANCE * scale


@pytest.mark.parametrize(("height", "width"), [(32, 32), (96, 160), (256, 320), (320, 224)])
def test_trunk_and_rpn_agree_with_torch_at_any_size(net, folder, height, width):
    image = torch.randn(1, 3, height, width)
    with torch.no_grad():
        features, evidence = net.trunk(image)
        objectness, deltas = net.rpn(features)
    features = [export_onnx.channels_last(x) for x in features]
    found = [export_onnx.channels_last(torch.cat(pair, 1)) for pair in zip(objectness, deltas, strict=True)]
    assert_close([*features, export_onnx.channels_last(evidence)], run(folder, "trunk", image))
    assert_close(found[:1], run(folder, "rpn_fine", features[0]))
    assert_close(found[1:], run(folder, "rpn_coarse", *features[1:]))


@pytest.mark.parametrize("people", [1, 7])
def test_heads_agree_with_torch_for_any_number_of_people(net, folder, people):
    with torch.no_grad():
        rois = torch.randn(people, WIDTH, 7, 7)
        boxes = torch.cat(net.box_head(rois), 1)
        assert_close([boxes], run(folder, "box_head", export_onnx.channels_last(rois)))
        rois = torch.randn(people, WIDTH, 32, 32)
        surface = export_onnx.channels_last(net.dense_head.surface(rois))
        labels, found = run(folder, "dense_head", export_onnx.channels_last(rois))
        assert_close([surface], [found])
        maps = torch.cat(net.dense_head(rois)[:2], 1)
        assert_close([maps], [graphs.interleaved(torch.from_numpy(labels)).numpy()])
        (points,) = run(folder, "keypoints", surface)
        assert_close([net.dense_head.with_keypoints(rois)[-1]], [graphs.interleaved(torch.from_numpy(points)).numpy()])


def test_a_bundle_opens_as_what_decoding_works_with(net, folder):
    opened = graphs.open_bundle(folder)
    image, rois = torch.randn(1, 3, 96, 160), torch.randn(2, WIDTH, 32, 32)
    with torch.no_grad():
        expected, found = Graphs.of_network(net).detector(image), opened.graphs.detector(image)
        *maps, points = net.dense_head.with_keypoints(rois)
    for tensors, arrays in zip(expected[:3], found[:3], strict=True):
        assert_close(tensors, [array.numpy() for array in arrays])
    assert_close([expected[3]], [found[3].numpy()])
    *logits, u, v = opened.graphs.dense_head(rois)
    assert_close(maps[:2], [array.numpy() for array in logits])
    # The charts have no background: what the network says of it is nobody's.
    assert_close([m[:, 1:] for m in maps[2:]], [u[:, 1:].numpy(), v[:, 1:].numpy()])
    assert not u[:, 0].any()
    assert_close([points], [opened.graphs.keypoints(rois).numpy()])
    assert opened.network.width == WIDTH


def test_crops_go_through_networks_of_their_own(net, crop_net, full_folder, folder):
    opened = graphs.open_bundle(full_folder)
    crops, boxes = torch.randn(2, 3, 64, 64), [torch.tensor([[8.0, 4.0, 56.0, 60.0]])] * 2
    with torch.no_grad():
        finest = crop_net.finest(crops)
        assert_close([finest], [opened.crop_graphs.finest(crops).numpy()])
        rois = targets.pooled([finest], boxes, net.config, net.config.dense_pool, level=0)
        expected, found = crop_net.dense_head(rois), opened.crop_graphs.dense_head(rois)
        whole = opened.graphs.dense_head(rois)
    assert_close(expected[:2], [array.numpy() for array in found[:2]])
    assert_close([m[:, 1:] for m in expected[2:]], [m[:, 1:].numpy() for m in found[2:]])
    assert_close([net.dense_head(rois)[0].detach()], [whole[0].numpy()])
    assert graphs.open_bundle(folder).crop_graphs is None


def test_parity_covers_the_networks_of_crops(net, crop_net, full_folder):
    image = np.random.default_rng(0).integers(0, 255, (64, 96, 3), np.uint8)
    errors = export_onnx.parity(net, full_folder, [image], crop_net)
    assert len(errors) == 16 + 1 + 1 + 4
    assert max(errors.values()) <= export_onnx.TOLERANCE
    mistaken = export_onnx.parity(net, full_folder, [image], net)
    assert mistaken["crop_trunk.p2"] > export_onnx.TOLERANCE
    assert mistaken["crop_dense_head.u"] > export_onnx.TOLERANCE


def test_parity_on_images_is_measured_for_every_output(net, folder):
    image = np.random.default_rng(0).integers(0, 255, (120, 160, 3), np.uint8)
    errors = export_onnx.parity(net, folder, [image])
    assert len(errors) == 6 + 1 + 4 + 1 + 1 + 4
    assert max(errors.values()) <= export_onnx.TOLERANCE


def test_parity_notices_other_weights(net, folder):
    other = export_onnx.copy.deepcopy(net)
    other.dense_head.out["u"].bias.data += 0.1
    image = np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)
    errors = export_onnx.parity(other, folder, [image])
    assert errors["dense_head.u"] > export_onnx.TOLERANCE
    assert errors["dense_head.v"] <= export_onnx.TOLERANCE


def test_no_batch_normalisation_is_left(full_folder):
    for name in (*bundle.GRAPHS, bundle.KEYPOINTS, *bundle.CROP_GRAPHS):
        kinds = [node.op_type for node in onnx.load(full_folder / f"{name}.onnx").graph.node]
        assert not set(kinds) & {"BatchNormalization", "Identity", "Expand", "Resize", "ConvTranspose", "Pad"}
        assert kinds.count("Shape") == {"trunk": 4, "crop_trunk": 3}.get(name, 0)  # of what is made twice as large


@pytest.mark.parametrize("kind", ["folder", "full_folder"])
def test_manifest_signs_the_files_and_lists_their_tensors(kind, request):
    folder, graph_names = request.getfixturevalue(kind), (*bundle.GRAPHS, bundle.KEYPOINTS)
    manifest = json.loads((folder / "manifest.json").read_text())
    others = {manifest["surface"]["file"], manifest["charts"]["file"]}
    if kind == "full_folder":
        graph_names += bundle.CROP_GRAPHS
        others.add(manifest["crop_charts"]["file"])
    assert set(manifest["files"]) == {f"{name}.onnx" for name in graph_names} | others
    for name, entry in manifest["files"].items():
        data = (folder / name).read_bytes()
        assert entry == {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
    for name, entry in manifest["graphs"].items():
        model = onnx.load(folder / entry["file"])
        assert [(o.domain, o.version) for o in model.opset_import] == [("", entry["opset"])]
        for side, values in (("inputs", model.graph.input), ("outputs", model.graph.output)):
            assert [tensor["name"] for tensor in entry[side]] == [value.name for value in values], name
            for tensor, value in zip(entry[side], values, strict=True):
                sizes = [d.dim_param or d.dim_value for d in value.type.tensor_type.shape.dim]
                fixed = [(a, b) for a, b in zip(tensor["shape"], sizes, strict=True) if isinstance(a, int)]
                assert all(a == b for a, b in fixed), tensor["name"]
    assert manifest["licence"]
    assert all({"name", "licence", "used_for"} <= set(entry) for entry in manifest["training_data"])


def test_weights_of_a_pack_of_photographs_name_its_sources_and_bring_its_credits(net, tmp_path, monkeypatch, capsys):
    write_shard(tmp_path / "val", 1)
    config = {name: getattr(net.config, name) for name in ("width", "backbone", "evidence", "keypoints")}
    torch.save({"ema": net.state_dict(), **config}, tmp_path / "weights.pt")
    (tmp_path / "credits.tsv").write_text("id\tlicence\tsource\tcredit\na\tCC-BY-4.0\tsome/book@12\tA. Author\n")
    given = [
        "export_onnx",
        "--checkpoint",
        str(tmp_path / "weights.pt"),
        "--data",
        str(tmp_path / "val"),
        "--images",
        "1",
    ]
    given += ["--credits", str(tmp_path / "credits.tsv"), "--out", str(tmp_path / "bundle")]
    monkeypatch.setattr("sys.argv", given)
    export_onnx.main()
    manifest = json.loads((tmp_path / "bundle/manifest.json").read_text())
    assert manifest["training_data"][:-1] == list(bundle.TRAINING_DATA)
    assert manifest["training_data"][-1] == {
        "name": "photographs of people of some/book, credited in CREDITS.tsv", "licence": "CC-BY-4.0",
        "used_for": "training",
    }  # fmt: skip
    assert (tmp_path / "bundle/CREDITS.tsv").read_bytes() == (tmp_path / "credits.tsv").read_bytes()


def test_a_manifest_is_refused_for_graphs_with_other_names(folder, tmp_path):
    for name in (*bundle.GRAPHS, bundle.KEYPOINTS):
        model = onnx.load(folder / f"{name}.onnx")
        if name == "box_head":
            model.graph.output[0].name = "scores"
        onnx.save(model, tmp_path / f"{name}.onnx")
    info = BundleInfo("tiny", "fp32")
    with pytest.raises(ValueError, match="scores"):
        bundle.write_manifest(tmp_path, info, NetworkConfig(width=WIDTH, evidence=4, keypoints=33), DecodeConfig())
