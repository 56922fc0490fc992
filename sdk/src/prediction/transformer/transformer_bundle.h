// The transformer of a prediction bundle (docs/reference/formats.md): its graphs and tables.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/session.h"
#include "prediction/codec/code_bundle.h"
#include "prediction/transformer/embedding_file.h"

namespace maq {

struct TransformerBundle {
  // A graph and its bytes, from which sessions are opened later.
  struct Graph {
    GraphSpec spec;
    std::string name;  // for error sentences
    std::vector<uint8_t> bytes;

    std::unique_ptr<Session> open(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime,
                                  const SessionSettings& settings) const {
      return open_session(runtime, bytes, spec, name, settings);
    }
  };

  // Returns whether a bundle has a transformer.
  static bool is_in(const CodeBundle& bundle) { return bundle.bundle.manifest.root.find("transformer").has_value(); }
  // Throws MAQ_ERROR_BAD_BUNDLE when the manifest is incomplete or graphs, tables and codes do not match; the
  // exceptions of read_embedding_file().
  explicit TransformerBundle(const CodeBundle& bundle);

  std::shared_ptr<const FrameCodes> codes;
  TransformerTables tables;
  size_t head_width = 0;           // width of a key or value
  float min_fps = 0, max_fps = 0;  // frame rates in training
  Graph context, masked;           // "context" and "slices" of the bundle
  std::vector<Graph> heads;        // [groups]
};

}  // namespace maq
