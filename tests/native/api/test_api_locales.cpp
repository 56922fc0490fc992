// Apps with a locale in which 1234.5 is written 1.234,5: the texts and files of the library are those of C all the
// same.
#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <locale>
#include <maquette/maquette.hpp>
#include <optional>
#include <sstream>
#include <string>

#include "support/samples/api_tiny_scene.h"

namespace {

class Comma : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

// German, from this machine, or made for the test where the parts of locales are there (Debian's package locales).
bool set_german_numbers(const TempFolder& folder) {
  if (std::setlocale(LC_NUMERIC, "de_DE.UTF-8") != nullptr) return true;
  const std::string command =
      "localedef -i de_DE -f UTF-8 '" + folder.file("de_DE.UTF-8") + "' >'" + folder.file("localedef.txt") + "' 2>&1";
  if (std::system(command.c_str()) != 0) return false;
  setenv("LOCPATH", folder.path().c_str(), 1);
  const bool is_set = std::setlocale(LC_NUMERIC, "de_DE.UTF-8") != nullptr;
  unsetenv("LOCPATH");
  return is_set;
}

class ApiLocales : public ::testing::Test {
 protected:
  ~ApiLocales() override {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_NUMERIC, "C");
  }

  // In C++ and, if available, in C.
  void write_numbers_with_commas() {
    std::locale::global(std::locale(std::locale::classic(), new Comma));
    std::ostringstream text;
    text << 1234.5;
    ASSERT_EQ(text.str(), "1.234,5");
    if (set_german_numbers(folder_)) {
      ASSERT_EQ(std::string(std::localeconv()->decimal_point), ",");
    }
  }

  void expect_error(maq_status status, const std::string& text) {
    EXPECT_EQ(status, MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(maq_last_error(nullptr)).find(text), std::string::npos) << maq_last_error(nullptr);
  }

  const TempFolder folder_;
  const maquette::Context context_;
};

TEST_F(ApiLocales, ErrorsHaveTheNumbersOfC) {
  write_numbers_with_commas();
  maq_clip* clip = nullptr;
  expect_error(maq_clip_create(context_.get(), "a.mp4", 0.0025, &clip), "fps is 0.0025, but must be 0.01 to 1000.");
  maq_source* source = nullptr;
  maq_source_config config = maquette::default_source_config();
  config.stall_ms = 1234567;
  expect_error(maq_source_create(context_.get(), "stub:pattern", &config, &source),
               "config.stall_ms is 1234567, but must be 50 to 60000.");
  expect_error(maq_source_create(context_.get(), "stub:pattern?fps=1234.5", nullptr, &source),
               "must be a number from 0.01 to 1000.");
  maq_frame_desc desc{};
  maq_frame* frame = nullptr;
  desc.struct_size = 4321;
  expect_error(maq_frame_wrap(context_.get(), &desc, nullptr, nullptr, &frame), "desc.struct_size is 4321,");
}

TEST_F(ApiLocales, NumbersOfUrisHaveAPoint) {
  write_numbers_with_commas();
  EXPECT_EQ(maquette::Source(context_, "stub:pattern?fps=12.5").info().fps, 12.5);
  maq_source* source = nullptr;
  expect_error(maq_source_create(context_.get(), "stub:pattern?fps=12,5", nullptr, &source), "fps=12,5");
}

TEST_F(ApiLocales, ManifestsAreReadAndResultsWrittenAsInC) {
  // One red cell: one person (make_tiny_bundle.py).
  std::vector<uint8_t> pixels(320 * 256 * 3);
  for (size_t y = 100; y < 104; ++y) {
    for (size_t x = 80; x < 84; ++x) pixels[(y * 320 + x) * 3] = 255;
  }
  maq_frame_desc desc;
  ASSERT_EQ(maq_frame_desc_init(&desc, sizeof desc), MAQ_OK);
  desc.format = MAQ_PIXEL_RGB8;
  desc.width_px = 320;
  desc.height_px = 256;
  desc.planes[0] = pixels.data();
  const auto saved = [&](const std::string& stem) {
    maquette::DensePose densepose(context_, MAQ_TEST_DATA "/tiny_bundle");
    const maquette::DensePoseResult result = densepose.run(maquette::Frame(context_, desc));
    EXPECT_EQ(maq_densepose_result_save(result.get(), folder_.file(stem).c_str()), MAQ_OK);
    return read_text(folder_.file(stem + ".json"));
  };
  const std::string in_c = saved("c");
  EXPECT_NE(in_c.find("67.2"), std::string::npos) << in_c;
  write_numbers_with_commas();
  EXPECT_EQ(saved("german"), in_c);
}

TEST_F(ApiLocales, RecordingsKeepTheirNumbers) {
  const auto record = [&](const std::string& name) {
    maquette::Source source(context_, "stub:pattern?size=16x12&fps=29.97");
    maquette::Recorder recorder(context_, folder_.file(name), &source);
    recorder.add(*source.next());
    recorder.finish();
    return read_text(folder_.file(name));
  };
  const auto fps = [&](const std::string& name) {
    return maquette::Source(context_, "rec:" + folder_.file(name)).info().fps;
  };
  const std::string in_c = record("c.maqrec");
  EXPECT_NE(in_c.find("29.97"), std::string::npos);
  write_numbers_with_commas();
  EXPECT_EQ(record("german.maqrec"), in_c);
  EXPECT_EQ(fps("german.maqrec"), 29.97);
}

TEST_F(ApiLocales, CapturesAreWhatTheyAreInC) {
  std::filesystem::copy(api_tiny_scene::kCapture, folder_.file("capture"), std::filesystem::copy_options::recursive);
  std::string cloud =
      "ply\nformat ascii 1.0\nelement vertex 1200\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (int i = 0; i < 1200; ++i) cloud += "0.5 1.25e-1 " + std::to_string(i % 3) + ".75\n";
  write_text(folder_.file("capture/cloud.ply"), cloud);
  const auto described = [&] {
    const maquette::Capture capture(context_, folder_.file("capture"));
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(17);
    const maq_capture_info info = capture.info();
    text << info.point_count << ' ' << info.up[0] << ' ' << info.up[1];
    for (uint32_t i = 0; i < info.view_count; ++i) {
      const maq_pinhole_camera camera = capture.view(i).camera;
      text << ' ' << camera.centre[0] << ' ' << camera.centre[1] << ' ' << camera.intrinsics.fx_px;
    }
    return text.str();
  };
  const std::string in_c = described();
  EXPECT_EQ(in_c.rfind("1200 ", 0), 0u) << in_c;
  write_numbers_with_commas();
  EXPECT_EQ(described(), in_c);
}

}  // namespace
