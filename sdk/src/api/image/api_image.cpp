#include "api/boundary.h"
#include "api/image/image_handle.h"
#include "image/files/image_file.h"

using namespace maq;

namespace {

struct Plane {
  const void* pixels;
  size_t pixel_bytes;
};

// Planes that the image does not have are empty: `pixels` is null.
Plane plane_of(const RenderedImage& image, int32_t plane) {
  switch (plane) {
    case MAQ_IMAGE_PLANE_BGR: return {image.bgr.data(), 3};
    case MAQ_IMAGE_PLANE_ALPHA: return {image.alpha.data(), 1};
    case MAQ_IMAGE_PLANE_DEPTH: return {image.depth.data(), sizeof(float)};
    case MAQ_IMAGE_PLANE_NORMALS: return {image.normals.empty() ? nullptr : image.normals.data(), 3 * sizeof(float)};
    default: return {image.template_points.empty() ? nullptr : image.template_points.data(), 3 * sizeof(float)};
  }
}

}  // namespace

maq_status maq_image_get_size(const maq_image* image, int32_t* width_px, int32_t* height_px) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(width_px, "width_px");
    require_argument(height_px, "height_px");
    *width_px = image->image.width_px;
    *height_px = image->image.height_px;
    return MAQ_OK;
  });
}

maq_status maq_image_get_plane(const maq_image* image, maq_image_plane plane, const void** pixels,
                               size_t* stride_bytes) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(pixels, "pixels");
    require_argument(stride_bytes, "stride_bytes");
    const int32_t wanted = number_in(plane);
    require_range("plane", wanted, int32_t(MAQ_IMAGE_PLANE_BGR), int32_t(MAQ_IMAGE_PLANE_TEMPLATE_POINTS));
    const Plane found = plane_of(image->image, wanted);
    if (found.pixels == nullptr) {
      throw ArgumentError("plane is ", wanted, ", but images of scenes have the planes ", int(MAQ_IMAGE_PLANE_BGR),
                          " to ", int(MAQ_IMAGE_PLANE_DEPTH), "; normals and template points are for heads.");
    }
    *pixels = found.pixels;
    *stride_bytes = found.pixel_bytes * size_t(image->image.width_px);
    return MAQ_OK;
  });
}

maq_status maq_image_save(const maq_image* image, const char* path, maq_image_alpha alpha) {
  return guarded(image, __func__, [&] {
    require_argument(image, "image");
    require_argument(path, "path");
    const int32_t wanted = number_in(alpha);
    require_range("alpha", wanted, int32_t(MAQ_IMAGE_ALPHA_OFF), int32_t(MAQ_IMAGE_ALPHA_ON));
    const RenderedImage& from = image->image;
    const ImageView bgr{
        MAQ_PIXEL_BGR8, from.width_px, from.height_px, {{from.bgr.data(), 3 * size_t(from.width_px)}, {}}};
    if (wanted == MAQ_IMAGE_ALPHA_ON) {
      write_image_file(bgr, from.alpha.data(), path);
    } else {
      write_image_file(bgr, path);
    }
    return MAQ_OK;
  });
}

void maq_image_release(maq_image* image) { return_handle(image, "image", __func__, return_to_pool<maq_image>); }
