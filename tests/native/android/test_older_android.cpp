// Image files before Android 11.
#include <gtest/gtest.h>

#include "image/files/image_file.h"
#include "support/expect_error.h"

TEST(OlderAndroid, SaysWhatAnAppCanDo) {
  const std::vector<uint8_t> jpeg = {0xff, 0xd8, 0xff, 0xe0, 0, 2};
  maq::Frame frame;
  for (int i = 0; i < 2; ++i) {
    expect_error(MAQ_ERROR_UNSUPPORTED, "Android 11",
                 [&] { maq::decode_image(jpeg, "The image", frame, maq::Orientation::kUpright); });
  }
  expect_error(MAQ_ERROR_UNSUPPORTED, "BitmapFactory", [&] {
    frame.allocate_bgr(2, 2);
    maq::encode_image(frame.image, ".png");
  });
}
