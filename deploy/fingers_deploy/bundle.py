"""Loading a policy bundle: nothing is used before everything has been verified.

The last metadata entry of the ONNX file is the SHA-256 of all bytes before it, so a
changed bit or a cut anywhere is found before anything is parsed. The manifest stands in
the metadata as well; beside the file it must be the same text.
"""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fingers_deploy.checks import parse_manifest
from fingers_deploy.errors import BundleError
from fingers_deploy.files import is_folder, read_regular
from fingers_deploy.manifest import Manifest
from fingers_deploy.network import NumpyPolicy, read_network
from fingers_deploy.strict_json import MAX_JSON_BYTES
from fingers_deploy.wire import Graph, read_model

POLICY_FILE = "policy.onnx"
MANIFEST_FILE = "manifest.json"
MANIFEST_KEY = "manifest"
PARITY_TOLERANCE = 1e-5
_CHECKSUM_KEY = b"file_sha256"
_MAX_BYTES = 64 * 2**20


@dataclass(frozen=True)
class Bundle:
    """A verified policy bundle.

    Attributes:
        source: where it was read from.
        manifest: what the policy reads and what its output means.
        model: the ONNX file.
        network: the network inside it, ready to run.
    """

    source: str
    manifest: Manifest
    model: bytes
    network: NumpyPolicy


def load_bundle(path: str | Path, joint_names: tuple[str, ...] | None = None) -> Bundle:
    """Reads a bundle and refuses one that is damaged or cannot be honoured.

    Args:
        path: a directory with `policy.onnx` and `manifest.json`, or one ONNX file.
        joint_names: order of the joints of the caller's hand; the bundle must have
            the same.

    Raises:
        BundleError: one sentence that names file, field, found and valid values.
    """
    path = Path(path)
    folder = is_folder(path, BundleError)
    policy = path / POLICY_FILE if folder else path
    bundle = decode_bundle(read_regular(policy, _MAX_BYTES, BundleError), policy)
    if folder:
        _check_beside(bundle, path / MANIFEST_FILE)
    if joint_names is not None:
        check_joint_order(bundle, joint_names)
    return bundle


def decode_bundle(data: bytes, source: object) -> Bundle:
    """Verifies the bytes of an ONNX file with an embedded manifest.

    Args:
        data: the file.
        source: its name, for messages.

    Raises:
        BundleError: as `load_bundle`.
    """
    _check_seal(data, source)
    try:
        graph = read_model(data)
        network = read_network(graph)
    except (ValueError, OverflowError) as error:
        valid = "the graph that the export writes"
        raise BundleError(source, "graph", error, valid) from error
    text = _embedded(graph, source)
    manifest = parse_manifest(text, f"{source}[{MANIFEST_KEY}]")
    _check_graph(manifest, graph, network, source)
    bundle = Bundle(str(source), manifest, data, network)
    check_parity(bundle, network)
    return bundle


def check_parity(bundle: Bundle, policy) -> None:
    """Compares a policy with the known answers in the manifest.

    The measure is max |Δa|, at most 1e-5·max(1, max |a|) with a before the clip.

    Args:
        bundle: the bundle with the answers.
        policy: maps an observation [N] to an action [n], both float32.

    Raises:
        BundleError: the policy does not give these answers.
    """
    parity, free = bundle.manifest.parity, replace(bundle.network, action_clip=np.inf)
    for i, (row, action) in enumerate(zip(parity.obs, parity.action, strict=True)):
        obs = np.asarray(row, np.float32)
        difference = float(np.max(np.abs(policy(obs) - np.asarray(action, np.float32))))
        allowed = PARITY_TOLERANCE * max(1.0, float(np.max(np.abs(free(obs)))))
        if not difference <= allowed:
            where, valid = f"parity.action[{i}]", f"at most {allowed:.3g} off"
            raise BundleError(bundle.source, where, f"{difference:.3g} off", valid)


def check_joint_order(bundle: Bundle, joint_names: tuple[str, ...] | list[str]) -> None:
    """Refuses a bundle whose joints are not these, in this order.

    Raises:
        BundleError: naming the first joint that differs.
    """
    ours, theirs = tuple(joint_names), bundle.manifest.interface.joint_names
    if len(ours) != len(theirs):
        raise BundleError(
            bundle.source,
            "interface.joint_names",
            f"{len(theirs)} joints",
            f"the {len(ours)} joints of this hand",
        )
    for i, (name, found) in enumerate(zip(ours, theirs, strict=True)):
        if name != found:
            where = f"interface.joint_names[{i}]"
            raise BundleError(bundle.source, where, found, f"{name}, as on this hand")


def seal(body: bytes) -> bytes:
    """Appends the checksum entry to a serialized ONNX model."""
    digest = hashlib.sha256(body).hexdigest().encode("ascii")
    entry = _text_field(1, _CHECKSUM_KEY) + _text_field(2, digest)
    return body + _text_field(14, entry)


def _text_field(number: int, text: bytes) -> bytes:
    """Encodes a protobuf field with fewer than 128 bytes."""
    return bytes([number << 3 | 2, len(text)]) + text


def _check_seal(data: bytes, source: object) -> None:
    body = data[: -len(seal(b""))]
    if seal(body) != data:
        found = "bytes that do not match their SHA-256"
        raise BundleError(source, "", found, "an unchanged file of the export")


def _embedded(graph: Graph, source: object) -> str:
    if MANIFEST_KEY not in graph.metadata:
        valid = f"metadata with the key {MANIFEST_KEY}"
        raise BundleError(source, "metadata", sorted(graph.metadata), valid)
    return graph.metadata[MANIFEST_KEY]


def _check_beside(bundle: Bundle, path: Path) -> None:
    """The manifest beside the policy must be the one inside it."""
    text = read_regular(path, MAX_JSON_BYTES, BundleError)
    parse_manifest(text, path)
    if text != _embedded(read_model(bundle.model), bundle.source).encode("utf-8"):
        found = "another manifest than the policy carries"
        raise BundleError(path, "", found, f"the manifest of this {POLICY_FILE}")


def _check_graph(
    manifest: Manifest, graph: Graph, network: NumpyPolicy, source: object
) -> None:
    policy, clip = manifest.policy, manifest.interface.action.clip
    found = {
        "policy.sha256": (policy.sha256, hashlib.sha256(graph.bare).hexdigest()),
        "policy.obs_size": (policy.obs_size, len(network.mean)),
        "policy.action_size": (policy.action_size, len(network.layers[-1][1])),
        "interface.action.clip": (np.float32(clip), np.float32(network.action_clip)),
    }
    for field, (stated, actual) in found.items():
        if stated != actual:
            raise BundleError(source, field, stated, f"{actual}, as in the graph")
