#include "head/reconstruction/head_texture.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "head/mesh/mesh_cleanup.h"
#include "head/reconstruction/head_surface.h"
#include "head/texture/template_texture.h"
#include "head/texture/texture_layout.h"
#include "image/files/image_file.h"
#include "image/files/jpeg.h"

namespace maq::head {
namespace {

constexpr double kBakedCell_m = 0.002;
constexpr float kCapTolerance_dm = 0.003f;
constexpr int kTextureQuality = 92;
constexpr float kBeyondPhoto = 127;

// Returns an image of 0 pixels if there is no texture. Throws MAQ_ERROR_UNREADABLE for another image than the head's
// file says.
TextureImage decoded(const StoredTexture& texture) {
  TextureImage made;
  if (texture.jpeg.empty()) return made;
  Frame frame;
  decode_image(texture.jpeg, "The head's texture", frame);
  const ImageView& picture = frame.image;
  if (picture.format != MAQ_PIXEL_BGR8 || picture.width_px != texture.side_px || picture.height_px != texture.side_px) {
    throw Error(MAQ_ERROR_UNREADABLE, "The head's texture has ", picture.width_px, " x ", picture.height_px,
                " pixels, but its file says ", texture.side_px, " a side in colour. Fit the head again.");
  }
  made.side_px = picture.width_px;
  for (int row = 0; row < picture.height_px; ++row) {
    const uint8_t* const from = picture.planes[0].data + size_t(row) * picture.planes[0].stride_bytes;
    made.bgr.insert(made.bgr.end(), from, from + 3 * size_t(picture.width_px));
  }
  return made;
}

std::vector<uint8_t> encoded(const TextureImage& image) {
  ImageView view;
  view.format = MAQ_PIXEL_BGR8;
  view.width_px = view.height_px = image.side_px;
  view.planes[0] = {image.bgr.data(), size_t(image.side_px) * 3};
  std::vector<uint8_t> jpeg;
  JpegEncoder().encode(view, kTextureQuality, jpeg);
  return jpeg;
}

}  // namespace

TextureCrop texture_crop(const ImageView& photo, const HeadSquare& square, int texture_px) {
  TextureCrop made;
  made.side_px = std::clamp(int(std::ceil(square.side_px)), 2, texture_px);
  const AffineMap to_photo = crop_to_photo(square, made.side_px);
  made.photo_to_crop = to_photo.inverse();
  NetworkInputSpec as_bytes;
  as_bytes.mean = {kBeyondPhoto, kBeyondPhoto, kBeyondPhoto};
  as_bytes.std = {1, 1, 1};
  CropInput crop;
  make_crop_input(photo, to_photo, {made.side_px, made.side_px}, as_bytes, crop);
  const size_t pixels = size_t(made.side_px) * size_t(made.side_px);
  made.rgb.resize(3 * pixels);
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      made.rgb[3 * i + c] = uint8_t(std::clamp(crop.values[c * pixels + i] + kBeyondPhoto + 0.5f, 0.0f, 255.0f));
    }
  }
  return made;
}

void set_texture_coordinates(const StoredHead& head, HeadMesh& mesh) {
  const double scale = 10 * head.scale.metres_per_unit;  // the mesh is in true decimetres
  const Vec3 normal = normalized(head.cut.normal);
  const auto is_cap = find_cap(mesh, {float(normal.x), float(normal.y), float(normal.z)},
                               float(scale * dot(normal, head.cut.point)), kCapTolerance_dm);
  set_texture_coordinates(mesh, is_cap);
}

StoredTexture make_texture(const StoredHead& head, const std::vector<TextureSource>& photos,
                           const TextureOptions& options, WorkerThreads& threads, const StoredTexture& earlier) {
  HeadMesh mesh = head_surface(head, {kBakedCell_m}, threads);
  set_texture_coordinates(head, mesh);
  const double scale = 10 * head.scale.metres_per_unit;
  std::vector<TexturePhoto> given;
  for (const TextureSource& source : photos) {
    TexturePhoto photo;
    photo.camera = crop_camera(source.camera, source.crop->photo_to_crop, source.crop->side_px);
    photo.camera.head_to_camera.translation = scale * photo.camera.head_to_camera.translation;
    photo.rgb = source.crop->rgb;
    photo.matte_side = source.seen->side;
    for (const HeadCell& cell : source.seen->cells) photo.matte.push_back(float(cell.matte));
    given.push_back(std::move(photo));
  }
  const TextureImage image = bake_texture(mesh, given, options, threads, decoded(earlier));
  return {image.side_px, encoded(image)};
}

std::vector<uint8_t> texture_of_template(const StoredHead& head, const HeadTemplate& onto, const HeadMesh& mesh,
                                         const TemplateRegistration& registration, WorkerThreads& threads) {
  const TextureImage own = decoded(head.texture);
  if (own.side_px == 0) return {};
  return encoded(texture_on_template(own, onto, registration.template_points, mesh.colours, threads));
}

}  // namespace maq::head
