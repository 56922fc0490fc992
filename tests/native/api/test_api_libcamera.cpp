// libcamera: sources through the C API, where libcamera is installed; what needs a camera is in tests/camera_vm.
#include <gtest/gtest.h>
#include <libcamera/camera_manager.h>

#include <maquette/maquette.hpp>
#include <thread>
#include <vector>

namespace {

class ApiLibcamera : public ::testing::Test {
 protected:
  maq_status open(const std::string& uri) {
    maq_source* source = nullptr;
    const maq_status status = maq_source_create(context_.get(), uri.c_str(), nullptr, &source);
    maq_source_destroy(source);
    return status;
  }
  std::string error() const { return maq_last_error(context_.get()); }

  // The cameras of libcamera in the list: none on most machines that run tests.
  int listed() {
    maq_camera_list* list = nullptr;
    EXPECT_EQ(maq_camera_list_create(context_.get(), &list), MAQ_OK) << error();
    int found = 0;
    for (uint32_t i = 0; i < maq_camera_list_get_count(list); ++i) {
      maq_camera_info info{};
      info.struct_size = sizeof info;
      EXPECT_EQ(maq_camera_list_get_camera(list, i, &info), MAQ_OK);
      found += std::string(info.uri).rfind("libcamera:", 0) == 0 ? 1 : 0;
    }
    maq_camera_list_destroy(list);
    return found;
  }

  maquette::Context context_;
};

TEST_F(ApiLibcamera, ACameraThatIsNotThereIsASentenceAndLibcameraItselfSaysNothing) {
  ::testing::internal::CaptureStderr();
  const std::string next = "libcamera:" + std::to_string(listed());
  for (const std::string& uri :
       {next, std::string("libcamera:123456789012345678901234567890"),
        std::string("libcamera:/base/soc/i2c0mux/i2c@1/imx219@10"),
        std::string("libcamera:\\_SB_.PCI0.XHC-1:1.0-1d6b:0102?size=640x480&fps=30&format=NV12")}) {
    EXPECT_EQ(open(uri), MAQ_ERROR_NOT_FOUND) << error();
    EXPECT_EQ(error().rfind(uri.substr(0, uri.find('?')) + " is not there: libcamera sees ", 0), 0u) << error();
    EXPECT_NE(error().find("Is it plugged in"), std::string::npos) << error();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(ApiLibcamera, OptionsThatItDoesNotHaveAreRefused) {
  EXPECT_EQ(open("libcamera:0?colour=red"), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(error().find("libcamera: has size, fps, format, exposure,"), std::string::npos) << error();
}

// libcamera aborts a process that makes a second manager.
TEST_F(ApiLibcamera, AnAppThatHasACameraManagerIsToldAndNotAborted) {
  const int before = listed();
  {
    libcamera::CameraManager own;
    ASSERT_EQ(own.start(), 0);
    EXPECT_EQ(open("libcamera:0"), MAQ_ERROR_BUSY);
    EXPECT_NE(error().find("runs a CameraManager of its own"), std::string::npos) << error();
    EXPECT_EQ(listed(), 0);
  }
  EXPECT_EQ(open("libcamera:/none"), MAQ_ERROR_NOT_FOUND) << error();
  EXPECT_EQ(listed(), before);
}

TEST_F(ApiLibcamera, ThreadsThatOpenAndListAtOnceWaitForOneAnother) {
  std::vector<std::thread> threads;
  for (int number = 0; number < 4; ++number) {
    threads.emplace_back([] {
      const maquette::Context context;
      for (int i = 0; i < 25; ++i) {
        maq_source* source = nullptr;
        EXPECT_EQ(maq_source_create(context.get(), "libcamera:/none", nullptr, &source), MAQ_ERROR_NOT_FOUND);
        maq_camera_list* list = nullptr;
        EXPECT_EQ(maq_camera_list_create(context.get(), &list), MAQ_OK);
        maq_camera_list_destroy(list);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
