// Bakes a head's texture: the photos' pixels where they see the surface well, the mesh's own colours elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "head/camera/head_camera.h"
#include "head/mesh/head_mesh.h"
#include "image/crop_input.h"

namespace maq::head {

inline constexpr int kMinTexture_px = 256, kMaxTexture_px = 2048;

// A square of a photo around the head, and what is known of it.
struct TexturePhoto {
  HeadCamera camera;         // of the square, in the decimetres of the mesh
  std::vector<uint8_t> rgb;  // [height][width][3] of the camera
  int matte_side = 0;
  std::vector<float> matte;  // [matte_side][matte_side] cells of the same square: 0 to 1, how much is the head
};

// The camera of a crop: `to_crop` is a rotation and a scaling, in continuous coordinates.
HeadCamera crop_camera(const HeadCamera& camera, const AffineMap& to_crop, int side_px);

struct TextureOptions {
  int side_px = 1024;
  bool delight = false;  // directional light is removed; the rest is as strong as on the seen surface
};

struct TextureImage {
  int side_px = 0;
  std::vector<uint8_t> bgr;   // [side][side][3]
  double photo_fraction = 0;  // of the head's texels without the cap, how much is from photos
};

// `mesh` has normals, colours and texture coordinates (texture_layout.h). A texel shows the outermost surface that lies
// there. A photo counts for it as far as the surface faces it, no other part of the mesh is before it, and the matte
// says that it is the head; finer photos more. Differences between photos and the mesh's colours are blended; their
// mean is made the same for all photos. Parts that no photo shows mirror the other side; else they have the mean colour
// of hair or skin in the photos (unseen_parts.h), and go over into what is seen without a step. On the neck, pixels far
// darker or brighter than elsewhere do not count: they show a collar. The same for any number of threads. `earlier`:
// texture of the head before these photos, of any size; its colours stay where these photos show nothing. Of 0 pixels:
// there is none.
TextureImage bake_texture(const HeadMesh& mesh, const std::vector<TexturePhoto>& photos, const TextureOptions& options,
                          WorkerThreads& threads, const TextureImage& earlier = {});

}  // namespace maq::head
