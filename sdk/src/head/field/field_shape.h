// The size of a head's field network: a distance network ("geometry") and a network of colour and template point
// ("surface") behind it.
#pragma once

#include <cstddef>

namespace maq::head {

// encoding  e = [x, y, z, then for l = 0 .. octaves - 1: sin(2^l x, y, z), cos(2^l x, y, z)]
// geometry  h = a(G0 e + g0), …, o = G h + g: o[0] the signed distance (dm), the rest the feature
// surface   c = a(C0 [o, x, y, z] + c0), …, s = C c + c: logits of red, green and blue, then the template point (dm)
// a(v) = (v + sqrt(v v + smoothing)) / 2 (squareplus).
struct FieldShape {
  int octaves = 6;
  int width = 64;           // of the hidden geometry layers
  int geometry_layers = 4;  // hidden ones
  int feature = 31;
  int surface_width = 64;
  int surface_layers = 2;  // hidden ones
  float smoothing = 2e-4f;
  // The layers that differ from head to head: the first ones of each network.
  int personal_geometry_layers = 3;
  int personal_surface_layers = 1;

  int encoding() const { return 3 + 6 * octaves; }
  int surface_inputs() const { return 1 + feature + 3; }
  // Layers are counted through: hidden ones of the geometry, its output, then the same of the surface.
  int first_surface_layer() const { return geometry_layers + 1; }
  int layers() const { return geometry_layers + 1 + surface_layers + 1; }
  int inputs(int layer) const;
  int outputs(int layer) const;
  bool is_personal(int layer) const;

  bool operator==(const FieldShape& other) const;
  bool operator!=(const FieldShape& other) const { return !(*this == other); }
};

inline constexpr int kSurfaceOutputs = 6;
inline constexpr int kMaxOctaves = 8, kMaxFieldWidth = 256, kMaxFieldLayers = 8;

// Throws MAQ_ERROR_UNSUPPORTED for a size beyond the engine's limits.
void check_field_shape(const FieldShape& shape);

// Rows of weights are padded to a multiple of this.
inline constexpr size_t kFieldRowPadding = 16;

}  // namespace maq::head
