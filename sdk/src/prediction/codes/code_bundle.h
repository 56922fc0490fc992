// What a bundle for prediction has (docs/reference/formats.md): the graphs that make a frame codes and codes a frame,
// and what codes stand for.
#pragma once

#include <memory>
#include <vector>

#include "nn/bundle.h"
#include "nn/session.h"
#include "prediction/codes/code_file.h"

namespace maq {

struct CodeBundle {
  // Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task, MAQ_ERROR_BAD_BUNDLE where the manifest lacks what is
  // read, or graphs and codes do not belong together; what read_code_file() throws.
  explicit CodeBundle(Bundle opened);

  Bundle bundle;  // without the bytes of the file of codes
  std::shared_ptr<const FrameCodes> codes;
  int frame_px = 0;  // side of the square that a frame is squeezed to

  Shape frame_shape() const { return {1, frame_px, frame_px, 3}; }
  Shape features_shape() const {
    return {1, int64_t(codes->side), int64_t(codes->side), int64_t(codes->slices * codes->width)};
  }
};

// Throws MAQ_ERROR_BAD_BUNDLE unless a side ("inputs") of a graph is these tensors, in their order.
struct NamedShape {
  const char* name;
  Shape shape;
};
void require_tensors(const Manifest& manifest, const char* graph, const char* what, const std::vector<TensorSpec>& side,
                     const std::vector<NamedShape>& wanted);

}  // namespace maq
