// Images of a mesh from a camera, under a simple light or in colours that show its shape.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "head/camera/head_camera.h"
#include "head/mesh/head_mesh.h"
#include "head/mesh/mesh_texture.h"
#include "image/rendered_image.h"

namespace maq::head {

// The colour of a point of the surface.
enum class MeshShading {
  kColour,    // its own, under the light: the texture's where there is one, else the vertices', else grey
  kShape,     // grey, under the light
  kNormals,   // R, G, B: to the right, up and to the camera, -1 to 1
  kTemplate,  // R, G, B: x, y, z of its template point, -template_reach to template_reach
  kDepth      // from white at middle_depth - depth_reach to black at middle_depth + depth_reach
};

struct RasterOptions {
  float near = 0.05f;  // nearer points are not drawn; in the mesh's unit
  // Where the light comes from, in the camera; of length 1. Over the viewer's left shoulder.
  std::array<float, 3> light = {-0.36f, -0.48f, -0.8f};
  float ambient = 0.35f;                          // of the colour, without light
  std::array<uint8_t, 3> grey = {200, 200, 200};  // R, G, B of meshes without colours, and of kShape
  MeshShading shading = MeshShading::kColour;
  const MeshTexture* texture = nullptr;        // of meshes with texture coordinates; may be null
  float template_reach = 1.4f;                 // of kTemplate
  float middle_depth = 0, depth_reach = 1.4f;  // of kDepth
  double pixel_aspect = 1;  // the vertical focal length over the horizontal one, which is the camera's
  bool is_smooth = false;   // edges: of 2 x 2 samples a pixel
  // Triangles that are seen from behind are left out. For closed meshes and cameras outside of them: half of the time.
  bool draws_front_alone = false;
};

class MeshRaster {
 public:
  // Draws both sides of each triangle. Colours, normals and template points are interpolated between its vertices,
  // correct in perspective; a mesh without normals gets its triangles' normals. The nearest triangle is seen; of
  // equally near ones the first. `image` has the mesh's colours, not weighed by alpha. Triangles without an area are
  // skipped. With smooth edges a pixel has the depth, normal and template point of its nearest sample. The same for any
  // number of threads. Throws MAQ_ERROR_INVALID_ARGUMENT for a camera that is not finite, MAQ_ERROR_IMAGE_SIZE for
  // images of no pixels or more than 16384 a side.
  void draw(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, WorkerThreads& threads,
            RenderedImage& image);

 private:
  struct Vertex {
    double x, y, z;            // in the camera; y times the pixel's aspect
    double column_px, row_px;  // not set behind the near plane
  };
  struct Attributes {
    std::array<float, 3> normal, colour, template_point;  // normal: in the camera
    std::array<float, 2> texture_uv;
  };
  struct Rows {
    int16_t first, last;  // empty: the triangle is not seen
  };
  struct Band;  // the samples of some rows

  void project(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, WorkerThreads& threads);
  void find_rows(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, WorkerThreads& threads);
  void draw_band(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, int top, int bottom,
                 Band& band) const;
  void shade_band(const HeadMesh& mesh, const HeadCamera& camera, const RasterOptions& options, int top, int bottom,
                  const Band& band, RenderedImage& image) const;

  std::vector<Vertex> vertices_;
  std::vector<Attributes> attributes_;              // of each vertex
  std::vector<Rows> rows_, chunk_rows_;             // of each triangle, of each chunk of them
  std::vector<std::vector<float>> inverse_depths_;  // of the samples of a band, for each thread
  std::vector<std::vector<uint32_t>> triangles_;    // the same: the visible triangle
};

}  // namespace maq::head
