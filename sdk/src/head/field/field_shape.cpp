#include "head/field/field_shape.h"

#include "core/error.h"

namespace maq::head {
namespace {

void check_range(const char* name, int value, int min, int max) {
  if (value < min || value > max) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The head field's ", name, " is ", value, ", but must be ", min, " to ", max,
                ".");
  }
}

}  // namespace

int FieldShape::inputs(int layer) const {
  if (layer == 0) return encoding();
  if (layer == first_surface_layer()) return surface_inputs();
  return layer < first_surface_layer() ? width : surface_width;
}

int FieldShape::outputs(int layer) const {
  if (layer == geometry_layers) return 1 + feature;
  if (layer == layers() - 1) return kSurfaceOutputs;
  return layer < geometry_layers ? width : surface_width;
}

bool FieldShape::is_personal(int layer) const {
  if (layer < first_surface_layer()) return layer < personal_geometry_layers;
  return layer - first_surface_layer() < personal_surface_layers;
}

bool FieldShape::operator==(const FieldShape& other) const {
  return octaves == other.octaves && width == other.width && geometry_layers == other.geometry_layers &&
         feature == other.feature && surface_width == other.surface_width && surface_layers == other.surface_layers &&
         smoothing == other.smoothing && personal_geometry_layers == other.personal_geometry_layers &&
         personal_surface_layers == other.personal_surface_layers;
}

void check_field_shape(const FieldShape& shape) {
  check_range("number of octaves", shape.octaves, 0, kMaxOctaves);
  check_range("width", shape.width, 1, kMaxFieldWidth);
  check_range("number of geometry layers", shape.geometry_layers, 1, kMaxFieldLayers);
  check_range("feature", shape.feature, 0, kMaxFieldWidth);
  check_range("surface width", shape.surface_width, 1, kMaxFieldWidth);
  check_range("number of surface layers", shape.surface_layers, 1, kMaxFieldLayers);
  check_range("number of personal geometry layers", shape.personal_geometry_layers, 0, shape.geometry_layers);
  check_range("number of personal surface layers", shape.personal_surface_layers, 0, shape.surface_layers);
  if (!(shape.smoothing >= 1e-8f && shape.smoothing <= 1.0f)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The head field's smoothing is ", shape.smoothing, ", but must be 1e-8 to 1.");
  }
}

}  // namespace maq::head
