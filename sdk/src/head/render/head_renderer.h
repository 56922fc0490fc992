// Images of a head from any camera.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/worker_threads.h"
#include "head/mesh/head_mesh.h"
#include "head/mesh/mesh_raster.h"
#include "head/mesh/mesh_texture.h"
#include "image/geometry/pinhole_camera.h"
#include "image/rendered_image.h"

namespace maq::head {

struct HeadRenderOptions {
  int threads = 1;
  double near_m = 0.01;            // nearer points are not drawn
  bool is_smooth = true;           // edges
  float shading_strength = 0.35f;  // 0: colours as they are; 1: black where no light falls
  MeshShading shading = MeshShading::kColour;
  std::optional<std::array<uint8_t, 3>> background_rgb;  // under the head; without it colours are not weighed by alpha
};

class HeadRenderer {
 public:
  // The mesh is in decimetres, as head_surface() makes it. A texture replaces its colours. Throws MAQ_ERROR_UNSUPPORTED
  // for a mesh without triangles.
  HeadRenderer(HeadMesh mesh, std::optional<MeshTexture> texture, const HeadRenderOptions& options);

  void set_shading(MeshShading shading) { options_.shading = shading; }

  // The world is the head in metres, y up, z to the front (file_axes.h), as are the image's lengths. Throws the errors
  // of check_camera().
  void render(const PinholeCamera& camera, RenderedImage& image);

  // A camera that sees the whole head, whichever way it is turned, 30 degrees wide along the image's shorter side.
  // `yaw_rad`: how far it stands to the person's left of the front, `pitch_rad`: how far above. Throws
  // MAQ_ERROR_INVALID_ARGUMENT for angles that are not finite, and the errors of check_image_size().
  PinholeCamera orbit_camera(double yaw_rad, double pitch_rad, int width_px, int height_px) const;

 private:
  void lay_over_background(RenderedImage& image);

  HeadMesh mesh_;  // metres, y up
  std::optional<MeshTexture> texture_;
  Vec3 middle_;
  double radius_ = 0;
  HeadRenderOptions options_;
  WorkerThreads threads_;
  MeshRaster raster_;
};

}  // namespace maq::head
