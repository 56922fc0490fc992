// The manifest of a model bundle (docs/reference/formats.md): the keys common to all bundles. The system of a task
// reads its own keys from `root`.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "nn/manifest_node.h"

namespace maq {

// A size of a tensor: a number, or a name or formula ("height/4") for one that depends on the input.
using Dimension = std::variant<int64_t, std::string>;

struct TensorSpec {
  std::string name;
  std::string type;  // "float32"
  std::vector<Dimension> shape;
};

struct GraphSpec {
  std::string file;
  std::vector<TensorSpec> inputs;
  std::vector<TensorSpec> outputs;
};

struct FileSpec {
  std::string sha256;  // 64 hexadecimal digits
  int64_t bytes = 0;
};

struct Manifest {
  std::string name;
  std::string version;
  std::string task;       // "densepose", "scenes", "edges", "heads", "prediction", "body"
  std::string precision;  // "fp32", "int8"
  std::map<std::string, FileSpec> files;
  std::map<std::string, GraphSpec> graphs;
  ManifestNode root;

  // For systems that check their own keys. Throw MAQ_ERROR_UNSUPPORTED for a bundle of another task,
  // MAQ_ERROR_BAD_BUNDLE where a graph is missing.
  void require_task(const std::string& wanted) const;
  void require_graphs(const std::vector<std::string>& names) const;
  // The file that a node names. Throws MAQ_ERROR_BAD_BUNDLE when "files" does not list it.
  std::string listed_file(const ManifestNode& node) const;
};

// Reads the text of a manifest. `origin` names it in errors. Throws MAQ_ERROR_BAD_BUNDLE for a value that is missing,
// of the wrong type or out of range, and MAQ_ERROR_UNSUPPORTED for another format version.
Manifest parse_manifest(const std::string& text, const std::string& origin);

}  // namespace maq
