// Pictures of a mesh: what a camera would see of it, under a simple light.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "head/camera/head_camera.h"
#include "head/mesh/head_mesh.h"

namespace maq::head {

struct RasterOptions {
  float near = 0.05f;  // what is nearer is not drawn; in the mesh's unit
  // Where the light comes from, in the camera; of length 1. Over the viewer's left shoulder.
  std::array<float, 3> light = {-0.36f, -0.48f, -0.8f};
  float ambient = 0.35f;                          // of the colour, without light
  std::array<uint8_t, 3> grey = {200, 200, 200};  // R, G, B of meshes without colours
};

// Row by row, without padding. Kept between uses.
struct RasterImage {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> bgr;    // 0 where there is no mesh
  std::vector<uint8_t> alpha;  // 255 on the mesh, else 0
  std::vector<float> depth;    // along the optical axis; 0 where there is no mesh
  std::vector<float> normals;  // x, y, z in the camera, of length 1; 0 where there is no mesh
};

class MeshRaster {
 public:
  // Draws both sides of each triangle: its colours and normals between those of its vertices, correct in perspective,
  // or its own normal where the mesh has none. The nearest is seen; of equally near ones the first. Triangles without
  // an area are skipped. The same for any number of threads.
  // Throws MAQ_ERROR_INVALID_ARGUMENT for a camera that is not finite, MAQ_ERROR_IMAGE_SIZE for pictures of no pixels
  // or more than 16384 a side.
  void draw(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, WorkerThreads& threads,
            RasterImage& image);

 private:
  void project(const HeadMesh& mesh, const HeadCamera& camera, double near, WorkerThreads& threads);
  void draw_band(const HeadMesh& mesh, const HeadCamera& camera, double near, int top, int bottom);
  void shade_band(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, int top, int bottom,
                  RasterImage& image) const;

  struct Vertex {
    double x, y, z;            // in the camera
    double column_px, row_px;  // not set behind the near plane
  };
  struct Rows {
    int first, last;  // empty: the triangle is not seen
  };
  std::vector<Vertex> vertices_;
  std::vector<Rows> rows_;            // of each triangle
  std::vector<float> inverse_depth_;  // of each pixel
  std::vector<uint32_t> triangles_;   // likewise: that which is seen
};

}  // namespace maq::head
