// The content of a bundle for heads (docs/reference/formats.md): the encoder, the prior and, optionally, the template
// head.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "head/fit/observations.h"
#include "head/head_prior.h"
#include "head/head_template.h"
#include "nn/bundle.h"

namespace maq::head {

// The face on the template head, which the encoder reads in a second pass, closer.
struct FaceSpec {
  Vec3 center_dm;
  double radius_dm = 0;
  double crop_sides = 0;  // side of that crop by the longer side of the face's box

  bool contains(Vec3 template_point) const { return length(template_point - center_dm) < radius_dm; }
};

// The encoder's input and output.
struct EncoderSpec {
  CellGrid cells;
  double crop_sides = 1.6;       // side of the crop by the longer side of the head's box, hair included
  std::optional<FaceSpec> face;  // none: there is no second pass

  int crop_px() const { return cells.side * cells.cell_px; }
};

// Null where the bundle has none. Throws the errors of HeadBundle and read_template().
std::shared_ptr<const HeadTemplate> template_of_bundle(const Bundle& bundle);

struct HeadBundle {
  // Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task, MAQ_ERROR_BAD_BUNDLE if the manifest lacks a key, or the
  // graph's input or output differs from the format, and the errors of read_prior().
  explicit HeadBundle(Bundle opened);

  Bundle bundle;  // without the bytes of prior and template
  EncoderSpec encoder;
  HeadPrior prior;
  std::array<uint8_t, 32> prior_sha256;               // of its file; stored heads name it
  std::shared_ptr<const HeadTemplate> template_head;  // may be null

  const GraphSpec& encoder_graph() const;
};

}  // namespace maq::head
