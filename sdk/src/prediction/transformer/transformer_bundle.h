// The part of a bundle for prediction that has the transformer (docs/formats.md): graphs, rows, and what they are for.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/session.h"
#include "prediction/codes/code_bundle.h"
#include "prediction/transformer/row_file.h"

namespace maq {

struct TransformerBundle {
  // A graph, and its bytes for sessions that are opened later.
  struct Graph {
    GraphSpec spec;
    std::string name;  // in errors
    std::vector<uint8_t> bytes;

    std::unique_ptr<Session> open(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime,
                                  const SessionSettings& settings) const {
      return std::make_unique<Session>(runtime, bytes, spec, name, settings);
    }
  };

  // Whether a bundle has that part.
  static bool is_in(const CodeBundle& bundle) { return bundle.bundle.manifest.root.find("transformer").has_value(); }
  // Throws MAQ_ERROR_BAD_BUNDLE where the manifest lacks what is read, or graphs, rows and codes do not belong
  // together; what read_row_file() throws.
  explicit TransformerBundle(const CodeBundle& bundle);

  std::shared_ptr<const FrameCodes> codes;
  TransformerTables tables;
  size_t head_width = 0;           // of a key or value
  float min_fps = 0, max_fps = 0;  // of the clips that it was trained on
  Graph context, slices;
  std::vector<Graph> heads;  // by slice
};

}  // namespace maq
