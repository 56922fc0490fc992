// The texture of a fitted head: the part of each photo that it uses, and the texture from these parts.
#pragma once

#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "head/bundle/head_encoder.h"
#include "head/fit/observations.h"
#include "head/head_template.h"
#include "head/mesh/head_mesh.h"
#include "head/registration/template_registration.h"
#include "head/stored_head.h"
#include "head/texture/texture_bake.h"

namespace maq::head {

// A photo around the head, as fine as the photo is, at most as the texture.
struct TextureCrop {
  int side_px = 0;
  std::vector<uint8_t> rgb;  // [side][side][3]; grey beyond the photo
  AffineMap photo_to_crop;
};

TextureCrop texture_crop(const ImageView& photo, const HeadSquare& square, int texture_px);

// One that was fitted to. The camera is of the whole photo; `crop` and `seen` are of one square.
struct TextureSource {
  const TextureCrop* crop = nullptr;
  const HeadObservations* seen = nullptr;
  HeadCamera camera;
};

// As a JPEG file. `earlier`: texture of the same head before these photos, which replaces the network's colours; empty:
// none. Throws the errors of head_surface(), decode_image() and JpegEncoder.
StoredTexture make_texture(const StoredHead& head, const std::vector<TextureSource>& photos,
                           const TextureOptions& options, WorkerThreads& threads, const StoredTexture& earlier = {});

// A JPEG file of the head's texture in the coordinates of its registered template (registered_template.h); empty if the
// head has none. Throws the errors of decode_image() and JpegEncoder.
std::vector<uint8_t> texture_of_template(const StoredHead& head, const HeadTemplate& onto, const HeadMesh& mesh,
                                         const TemplateRegistration& registration, WorkerThreads& threads);

// Sets the texture coordinates of a mesh of the head (head_surface).
void set_texture_coordinates(const StoredHead& head, HeadMesh& mesh);

}  // namespace maq::head
