#include "nn/manifest.h"

#include "core/build_info.h"
#include "core/error.h"

namespace maq {
namespace {

constexpr int kFormatVersion = 4;

void check_format(const ManifestNode& root) {
  if (root.at("format").text() != "maquette-bundle") root.at("format").fail("must be maquette-bundle");
  const int version = root.at("format_version").integer(0, 1 << 20);
  if (version == kFormatVersion) return;
  const std::string name = root.at("name").text();
  if (version < kFormatVersion) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", name, " has format version ", version, ", but Maquette ",
                sdk_version(), " reads version ", kFormatVersion,
                ": export it again with the export tools of this version, or use the Maquette that it was made for.");
  }
  throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", name, " has format version ", version, ", but Maquette ", sdk_version(),
              " reads version ", kFormatVersion,
              ": use a newer Maquette, or export the bundle with the export tools of this version.");
}

FileSpec read_file_spec(const ManifestNode& node) {
  FileSpec file{node.at("sha256").text(), node.at("bytes").size()};
  if (file.sha256.size() != 64) node.at("sha256").fail("is not a SHA-256 of 64 hexadecimal digits");
  return file;
}

Dimension read_dimension(const ManifestNode& node) {
  if (node.is_text()) return node.text();
  return int64_t(node.integer(1, 1 << 20));
}

std::vector<TensorSpec> read_tensors(const ManifestNode& list) {
  std::vector<TensorSpec> tensors;
  for (const ManifestNode& node : list.elements()) {
    TensorSpec tensor{node.at("name").text(), node.at("type").text(), {}};
    for (const ManifestNode& size : node.at("shape").elements()) tensor.shape.push_back(read_dimension(size));
    tensors.push_back(std::move(tensor));
  }
  return tensors;
}

}  // namespace

Manifest parse_manifest(const std::string& text, const std::string& origin) {
  const ManifestNode root = ManifestNode::parse(text, origin);
  check_format(root);
  Manifest manifest{root.at("name").text(),
                    root.at("version").text(),
                    root.at("task").text(),
                    root.at("precision").text(),
                    {},
                    {},
                    root};
  for (const auto& [name, node] : root.at("files").members()) {
    // A manifest must not reach outside its folder.
    if (name.empty() || name.find_first_of("/\\") != std::string::npos || name[0] == '.')
      node.fail("is not a plain file name");
    manifest.files[name] = read_file_spec(node);
  }
  for (const auto& [name, node] : root.at("graphs").members()) {
    manifest.graphs[name] = {manifest.listed_file(node.at("file")), read_tensors(node.at("inputs")),
                             read_tensors(node.at("outputs"))};
  }
  return manifest;
}

void Manifest::require_task(const std::string& wanted) const {
  if (task == wanted) return;
  throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", name, " is for the task ", task, ", but one for ", wanted,
              " is needed; give the folder of a bundle with the task ", wanted, ".");
}

void Manifest::require_graphs(const std::vector<std::string>& names) const {
  for (const std::string& graph : names) root.at("graphs").at(graph);
}

std::string Manifest::listed_file(const ManifestNode& node) const {
  const std::string file = node.text();
  if (files.count(file) == 0) node.fail("names ", file, ", which \"files\" does not list");
  return file;
}

}  // namespace maq
