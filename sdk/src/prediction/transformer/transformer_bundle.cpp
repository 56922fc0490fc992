#include "prediction/transformer/transformer_bundle.h"

#include <utility>

#include "core/error.h"
#include "prediction/transformer/embedding_sums.h"

namespace maq {
namespace {

TransformerTables tables_of(const CodeBundle& bundle) {
  const Manifest& manifest = bundle.bundle.manifest;
  const ManifestNode node = manifest.root.at("transformer");
  const std::string name = manifest.listed_file(node.at("file"));
  const auto found = bundle.bundle.files.find(name);
  if (found == bundle.bundle.files.end()) node.at("file").fail("is ", name, ", which holds the codes");
  TransformerTables tables =
      read_embedding_file(found->second.data(), found->second.size(), bundle.bundle.path_of(name));
  const FrameCodes& codes = *bundle.codes;
  if (tables.groups != codes.groups || tables.entries != codes.entries || tables.side != codes.side) {
    node.fail("is of ", tables.side, " x ", tables.side, " cells of ", tables.groups, " codes of ", tables.entries,
              ", but the bundle's are ", codes.side, " x ", codes.side, ", ", codes.groups, " and ", codes.entries);
  }
  return tables;
}

TransformerBundle::Graph graph_of(const CodeBundle& bundle, const std::string& name) {
  bundle.bundle.manifest.require_graphs({name});
  const GraphSpec& spec = bundle.bundle.manifest.graphs.at(name);
  return {spec, bundle.bundle.path_of(spec.file), bundle.bundle.files.at(spec.file)};
}

using Tensors = std::vector<TensorSpec>;

std::string text_of(const Tensors& side) {
  std::string text;
  for (const TensorSpec& tensor : side) {
    text += (text.empty() ? "" : ", ") + tensor.name + " [";
    for (const Dimension& size : tensor.shape) {
      const int64_t* const number = std::get_if<int64_t>(&size);
      text += (text.back() == '[' ? "" : ", ") +
              (number != nullptr ? std::to_string(*number) : std::get<std::string>(size));
    }
    text += "]";
  }
  return text;
}

void require_side(const Manifest& manifest, const std::string& graph, const char* what, const Tensors& found,
                  const Tensors& wanted) {
  const auto is_same = [](const TensorSpec& one, const TensorSpec& other) {
    return one.name == other.name && one.shape == other.shape;
  };
  if (std::equal(found.begin(), found.end(), wanted.begin(), wanted.end(), is_same)) return;
  throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", graph, " must have the ", what, " ",
              text_of(wanted), ". Export the bundle again.");
}

TensorSpec tensor(const std::string& name, std::vector<Dimension> shape) { return {name, "float32", std::move(shape)}; }

// The last size of a graph's third input, the keys of its first layer; 0 where there is none.
int64_t head_width_of(const GraphSpec& masked) {
  if (masked.inputs.size() < 3 || masked.inputs[2].shape.size() != 4) return 0;
  const int64_t* const width = std::get_if<int64_t>(&masked.inputs[2].shape[3]);
  return width != nullptr && *width > 0 && *width <= 4096 ? *width : 0;
}

}  // namespace

TransformerBundle::TransformerBundle(const CodeBundle& bundle)
    : codes(bundle.codes),
      tables(tables_of(bundle)),
      context(graph_of(bundle, "context")),
      masked(graph_of(bundle, "slices")) {
  const Manifest& manifest = bundle.bundle.manifest;
  const auto range = manifest.root.at("transformer").at("fps").numbers<2>(0.1, 1000);
  min_fps = range[0], max_fps = range[1];
  if (max_fps < min_fps) manifest.root.at("transformer").at("fps").fail("ends before it begins");

  const auto cells = int64_t(tables.cells()), width = int64_t(tables.width), embedding = int64_t(tables.embedding);
  require_side(manifest, "context", "inputs", context.spec.inputs,
               {tensor("summed", {1, cells, embedding}), tensor("time_step", {1, 1})});
  require_side(manifest, "context", "outputs", context.spec.outputs, {tensor("context", {1, cells, width})});

  head_width = size_t(head_width_of(masked.spec));
  const auto heads_count = int64_t(tables.heads), of_head = int64_t(head_width);
  Tensors inputs{tensor("context", {"samples", "rows", width}),
                 tensor("near", {"samples", "rows", int64_t(kNearCodes) * embedding})};
  Tensors outputs{tensor("features", {"samples", "rows", width})};
  for (size_t layer = 0; layer < tables.layers; ++layer) {
    const std::string number = std::to_string(layer);
    for (const char* name : {"keys_", "values_"}) {
      inputs.push_back(tensor(name + number, {"samples", heads_count, "kept", of_head}));
      outputs.push_back(tensor(std::string("new_") + name + number, {"samples", heads_count, "rows", of_head}));
    }
    inputs.push_back(tensor("bias_" + number, {heads_count, "rows", "kept_and_rows"}));
  }
  require_side(manifest, "slices", "inputs", masked.spec.inputs, inputs);
  require_side(manifest, "slices", "outputs", masked.spec.outputs, outputs);

  for (size_t k = 0; k < tables.groups; ++k) {
    const std::string name = "head_" + std::to_string(k);
    heads.push_back(graph_of(bundle, name));
    require_side(manifest, name, "inputs", heads.back().spec.inputs,
                 {tensor("features", {"samples", "rows", width}), tensor("earlier", {"samples", "rows", width})});
    require_side(manifest, name, "outputs", heads.back().spec.outputs,
                 {tensor("logits", {"samples", "rows", int64_t(tables.entries)})});
  }
}

}  // namespace maq
