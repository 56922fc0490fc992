// The bundle of round heads (tests/native/generate/make_round_heads.py) through the C API, and photos it sees a head
// in.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <maquette/maquette.hpp>
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

inline maq_head_mesh_options of_cell(double cell_m) {
  maq_head_mesh_options options = maquette::default_head_mesh_options();
  options.cell_m = cell_m;
  return options;
}

inline const maq_head_mesh_options coarse = of_cell(0.008);

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

  const maquette::Context context;
  const PlainPhoto image, black{320, 240, {0, 0, 0}}, blue{320, 240, {200, 60, 20}};
  const maquette::Frame frame{context, image.desc}, black_frame{context, black.desc}, blue_frame{context, blue.desc};
  const maq_head_photo known = with_box(110, 60, 200, 180);
  maquette::HeadBuilder builder{context, kHeadsBundle};
};

}  // namespace round_heads
