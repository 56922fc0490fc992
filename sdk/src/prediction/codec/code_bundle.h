// A bundle of the task "prediction" (docs/reference/formats.md): the encoder, the decoder, and the codebook.
#pragma once

#include <memory>
#include <vector>

#include "nn/bundle.h"
#include "nn/session.h"
#include "prediction/codec/code_file.h"

namespace maq {

struct CodeBundle {
  // Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task; MAQ_ERROR_BAD_BUNDLE when the manifest is incomplete or
  // graphs and codes do not match; the exceptions of read_code_file().
  explicit CodeBundle(Bundle opened);

  Bundle bundle;  // without the bytes of the code file
  std::shared_ptr<const FrameCodes> codes;
  int frame_px = 0;  // side of the networks' square input

  Shape frame_shape() const { return {1, frame_px, frame_px, 3}; }
  Shape features_shape() const {
    return {1, int64_t(codes->side), int64_t(codes->side), int64_t(codes->groups * codes->width)};
  }
};

// Throws MAQ_ERROR_BAD_BUNDLE unless the "inputs" or "outputs" of a graph are these tensors, in this order.
struct NamedShape {
  const char* name;
  Shape shape;
};
void require_tensors(const Manifest& manifest, const char* graph, const char* what, const std::vector<TensorSpec>& side,
                     const std::vector<NamedShape>& wanted);

}  // namespace maq
