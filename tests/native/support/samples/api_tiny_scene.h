// The scene of data/tiny_scene (make_tiny_scene.py) through the C API, and a ball that an app might have.
#pragma once

#include <cmath>
#include <cstring>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "support/temp_folder.h"

namespace api_tiny_scene {

inline const std::string kCapture = MAQ_TEST_DATA "/tiny_scene/capture";
inline const std::string kBundle = MAQ_TEST_DATA "/tiny_scene/bundle";

inline maq_scene_build_config build_config() {
  maq_scene_build_config config = maquette::default_scene_build_config();
  config.model.bundle_path = kBundle.c_str();
  config.model.threads = 1;
  return config;
}

inline maq_scene_renderer_config renderer_config() {
  maq_scene_renderer_config config = maquette::default_scene_renderer_config();
  config.model.bundle_path = kBundle.c_str();
  config.model.threads = 1;
  return config;
}

// The points of capture/cloud.ply.
inline std::vector<float> capture_places() {
  const std::string bytes = read_text(kCapture + "/cloud.ply"), end = "end_header\n";
  const std::string numbers = bytes.substr(bytes.find(end) + end.size());
  std::vector<float> places(numbers.size() / sizeof(float));
  std::memcpy(places.data(), numbers.data(), places.size() * sizeof(float));
  return places;
}

// Even on a ball of radius 1 about the origin.
inline std::vector<float> ball(size_t count) {
  std::vector<float> places;
  for (size_t i = 0; i < count; ++i) {
    const double z = 1 - 2 * (double(i) + 0.5) / double(count), radius = std::sqrt(1 - z * z),
                 angle = 2.399963 * double(i);
    for (const double value : {radius * std::cos(angle), radius * std::sin(angle), z}) places.push_back(float(value));
  }
  return places;
}

inline maq_point_cloud cloud_of(const std::vector<float>& places) {
  maq_point_cloud cloud{};
  cloud.struct_size = sizeof cloud;
  cloud.point_count = places.size() / 3;
  cloud.xyz = places.data();
  cloud.up[2] = 1;
  return cloud;
}

// At (3, 0, 0), turned about the world's z; looks at the origin, z is up in the image.
inline maq_pinhole_camera camera_at(double angle, int width_px = 64, int height_px = 48) {
  maq_pinhole_camera camera{};
  camera.struct_size = sizeof camera;
  camera.intrinsics.width_px = width_px;
  camera.intrinsics.height_px = height_px;
  camera.intrinsics.fx_px = camera.intrinsics.fy_px = width_px;
  camera.intrinsics.cx_px = 0.5 * (width_px - 1);
  camera.intrinsics.cy_px = 0.5 * (height_px - 1);
  const double c = std::cos(angle), s = std::sin(angle);
  const double rotation[9] = {-s, c, 0, 0, 0, -1, -c, -s, 0};
  std::memcpy(camera.rotation, rotation, sizeof rotation);
  camera.centre[0] = 3 * c;
  camera.centre[1] = 3 * s;
  return camera;
}

// A photo with colours that change from pixel to pixel, in any format.
struct Photo {
  explicit Photo(maq_pixel_format format = MAQ_PIXEL_BGR8, int width_px = 64, int height_px = 48)
      : pixels(size_t(width_px) * size_t(height_px) * 4) {
    for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = uint8_t(60 + i * 7 % 120);
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = format;
    desc.width_px = width_px;
    desc.height_px = height_px;
    desc.planes[0] = pixels.data();
    if (format == MAQ_PIXEL_NV12) desc.planes[1] = pixels.data() + size_t(width_px) * size_t(height_px);
  }
  std::vector<uint8_t> pixels;
  maq_frame_desc desc;
};

// A scene of the ball, from four sides.
inline maquette::Scene ball_scene(const maquette::Context& context, size_t points = 2000) {
  const std::vector<float> places = ball(points);
  maquette::SceneBuilder builder(context, build_config(), cloud_of(places));
  const Photo photo;
  for (int i = 0; i < 4; ++i) builder.add_view(maquette::Frame(context, photo.desc), camera_at(1.5 * i));
  return builder.finish();
}

}  // namespace api_tiny_scene
