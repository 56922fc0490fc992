// Execution providers: with a library that has none, and with one that says it has them.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "densepose/densepose.h"
#include "support/fakes/fake_provider_onnxruntime.h"

namespace {

class Providers : public ::testing::Test {
 protected:
  Providers() {
    const auto fake = reinterpret_cast<FakeProvidersFunction>(
        dlsym(dlopen(MAQ_TEST_FAKE_PROVIDERS, RTLD_NOW | RTLD_LOCAL), "fake_providers"));
    fake_ = fake();
    *fake_ = {};
    fake_->taken_nodes = 30;
    fake_->other_nodes = 20;
  }

  // Runs the tiny bundle over an image of one person, on two threads.
  maq::DensePoseResult run(const std::string& library, maq_provider provider) {
    const auto take = [](void* lines, maq_log_level, const char* text) {
      *static_cast<std::string*>(lines) += std::string(text) + "\n";
    };
    const auto runtime = std::make_shared<maq::OnnxRuntimeLibrary>(library, maq::Log(MAQ_LOG_INFO, take, &log_));
    maq::DensePoseSettings settings;
    settings.threads = 2;
    settings.provider = provider;
    maq::DensePose densepose(runtime, maq::read_bundle(MAQ_TEST_DATA "/tiny_bundle"), settings);
    cv::Mat picture(256, 320, CV_8UC3, cv::Scalar());
    picture(cv::Rect(80, 100, 4, 4)) = cv::Scalar(0, 0, 255);
    maq::DensePoseResult result;
    densepose.run({MAQ_PIXEL_BGR8, picture.cols, picture.rows, {{picture.data, picture.step}, {}}}, result);
    return result;
  }
  bool was_said(const std::string& text) const { return log_.find(text) != std::string::npos; }

  FakeProviders* fake_ = nullptr;
  std::string log_;
};

TEST_F(Providers, WithoutThemTheCpuRunsAndTheLogSaysWhyOnce) {
  const maq::DensePoseResult wanted = run(MAQ_TEST_ONNXRUNTIME, MAQ_PROVIDER_CPU);
  EXPECT_FALSE(was_said("on the CPU")) << log_;
  for (const auto& [provider, why] :
       {std::pair(MAQ_PROVIDER_XNNPACK, "Networks run on the CPU: XNNPACK is not offered: "),
        std::pair(MAQ_PROVIDER_NNAPI,
                  "Networks run on the CPU: NNAPI is not offered: this build of ONNX Runtime is "
                  "not for Android")}) {
    log_.clear();
    const maq::DensePoseResult result = run(MAQ_TEST_ONNXRUNTIME, provider);
    EXPECT_EQ(result.stats.provider, MAQ_PROVIDER_CPU);
    EXPECT_EQ(result.people.size(), 1u);
    EXPECT_EQ(result.planes.part, wanted.planes.part);
    const size_t said = log_.find(why);
    ASSERT_NE(said, std::string::npos) << log_;
    EXPECT_EQ(log_.find("on the CPU", said + 40), std::string::npos) << log_;
  }
}

TEST_F(Providers, XnnpackHasTheThreadsAndTheSessionOneThatDoesNotSpin) {
  const maq::DensePoseResult wanted = run(MAQ_TEST_ONNXRUNTIME, MAQ_PROVIDER_CPU);
  const maq::DensePoseResult result = run(MAQ_TEST_FAKE_PROVIDERS, MAQ_PROVIDER_XNNPACK);
  EXPECT_EQ(result.stats.provider, MAQ_PROVIDER_XNNPACK);
  EXPECT_EQ(result.planes.part, wanted.planes.part);
  EXPECT_EQ(std::string(fake_->name), "XNNPACK");
  EXPECT_EQ(std::string(fake_->threads), "2");
  EXPECT_EQ(fake_->session_threads, 1) << "of the trunk, which is made last, for the size of the picture";
  EXPECT_EQ(std::string(fake_->spins), "0");
  EXPECT_EQ(fake_->appended, 4) << "to see whether it is there, for both heads and for the trunk";
  EXPECT_TRUE(was_said("trunk.onnx: XNNPACK takes 30 of 50 nodes, in 1 parts")) << log_;
}

TEST_F(Providers, NnapiLeavesTheSessionItsThreadsAndDoesNotUseItsOwnCpuKernels) {
  const maq::DensePoseResult result = run(MAQ_TEST_FAKE_PROVIDERS, MAQ_PROVIDER_NNAPI);
  EXPECT_EQ(result.stats.provider, MAQ_PROVIDER_NNAPI);
  EXPECT_EQ(std::string(fake_->name), "NNAPI");
  EXPECT_EQ(std::string(fake_->threads), "no CPU");
  EXPECT_EQ(fake_->session_threads, 2);
  EXPECT_EQ(std::string(fake_->spins), "1");
}

TEST_F(Providers, OneThatTakesLessThanHalfOfAGraphIsNotUsed) {
  fake_->taken_nodes = 19;
  const maq::DensePoseResult result = run(MAQ_TEST_FAKE_PROVIDERS, MAQ_PROVIDER_XNNPACK);
  EXPECT_EQ(result.stats.provider, MAQ_PROVIDER_CPU);
  EXPECT_EQ(result.people.size(), 1u);
  EXPECT_EQ(fake_->session_threads, 2);
  EXPECT_EQ(std::string(fake_->spins), "1");
  EXPECT_TRUE(was_said("trunk.onnx runs on the CPU: XNNPACK takes 19 of 39 nodes")) << log_;
}

TEST_F(Providers, ASessionThatCannotBeMadeWithOneIsMadeWithout) {
  fake_->fails = 1;
  const maq::DensePoseResult result = run(MAQ_TEST_FAKE_PROVIDERS, MAQ_PROVIDER_NNAPI);
  EXPECT_EQ(result.stats.provider, MAQ_PROVIDER_CPU);
  EXPECT_EQ(result.people.size(), 1u);
  EXPECT_TRUE(was_said("the device is busy")) << log_;
}

}  // namespace
