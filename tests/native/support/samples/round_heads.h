// The bundle of round heads (tests/native/generate/make_round_heads.py) through the C API, and photos it sees a head
// in.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <maquette/maquette.hpp>
#include <string>
#include <utility>
#include <vector>

namespace round_heads {

inline constexpr char kHeadsBundle[] = MAQ_TEST_DATA "/round_heads/bundle";

// In one colour: the encoder of the bundle sees a head in what is not black, and another one in blue.
struct PlainPhoto {
  explicit PlainPhoto(int width = 320, int height = 240, std::array<uint8_t, 3> bgr = {120, 130, 140})
      : pixels(size_t(width) * size_t(height) * 3) {
    for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = bgr[i % 3];
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_BGR8;
    desc.width_px = width;
    desc.height_px = height;
    desc.planes[0] = pixels.data();
  }
  std::vector<uint8_t> pixels;
  maq_frame_desc desc;
};

inline maq_head_photo with_box(float left, float top, float right, float bottom) {
  maq_head_photo photo = maquette::default_head_photo();
  photo.box_px[0] = left, photo.box_px[1] = top, photo.box_px[2] = right, photo.box_px[3] = bottom;
  return photo;
}

// Calls a function with the fraction done; what it returns goes on or cancels.
struct ProgressCalls {
  std::function<bool(double done)> function;
  std::string last_stage;

  static int32_t call(void* calls, double done, const char* stage) {
    auto* const self = static_cast<ProgressCalls*>(calls);
    self->last_stage = stage;
    return !self->function || self->function(done) ? 1 : 0;
  }
};

// Without a texture, which would be most of the time.
inline maq_head_builder_config builder_config(ProgressCalls* progress) {
  maq_head_builder_config config = maquette::default_head_builder_config();
  config.model.bundle_path = kHeadsBundle;
  config.texture = MAQ_HEAD_TEXTURE_OFF;
  config.progress_callback = ProgressCalls::call;
  config.progress_user_data = progress;
  return config;
}

inline maq_head_mesh_config of_cell(double cell_m) {
  maq_head_mesh_config config = maquette::default_head_mesh_config();
  config.cell_m = cell_m;
  return config;
}

inline const maq_head_mesh_config coarse = of_cell(0.008);

// A mesh with its arrays.
struct Mesh : maq_head_mesh_data {
  explicit Mesh(const maquette::Head& head, const maq_head_mesh_config& config = maquette::default_head_mesh_config())
      : maq_head_mesh_data{}, mesh(head, config) {
    static_cast<maq_head_mesh_data&>(*this) = mesh.data();
  }
  maquette::HeadMesh mesh;
};

class RoundHeads : public testing::Test {
 protected:
  static void expect_text(const char* text) {
    EXPECT_NE(std::strstr(maq_last_error(nullptr), text), nullptr) << maq_last_error(nullptr);
  }
  void expect_refused(maq_status status, const char* text, const maq_frame* given, const maq_head_photo& photo) {
    EXPECT_EQ(maq_head_builder_add_photo(builder.get(), given, &photo), status);
    expect_text(text);
  }
  maquette::Head fitted(double seconds = 0) {
    builder.clear();
    builder.add_photo(frame, known);
    return builder.fit(seconds);
  }
  // `called` is called with the fraction done, for this fit alone.
  maquette::Head fit(double seconds, std::function<bool(double)> called) {
    progress.function = std::move(called);
    struct Reset {
      ProgressCalls& calls;
      ~Reset() { calls.function = nullptr; }
    } reset{progress};
    return builder.fit(seconds);
  }

  const maquette::Context context;
  const PlainPhoto image, black{320, 240, {0, 0, 0}}, blue{320, 240, {200, 60, 20}};
  const maquette::Frame frame{context, image.desc}, black_frame{context, black.desc}, blue_frame{context, blue.desc};
  const maq_head_photo known = with_box(110, 60, 200, 180);
  ProgressCalls progress;
  maquette::HeadBuilder builder{context, builder_config(&progress)};
};

}  // namespace round_heads
