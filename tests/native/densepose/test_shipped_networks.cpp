// The shipped int8 networks: the same answer however they are run, and what they say of extreme frames.
#include <sys/resource.h>

#include <gtest/gtest.h>
#include <onnxruntime_c_api.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "densepose/densepose.h"

namespace {

using Tensors = std::vector<std::vector<float>>;

// A graph of a bundle without any of the optimisations of ONNX Runtime: node by node, as it was exported.
class UnoptimisedGraph {
 public:
  UnoptimisedGraph(const maq::OnnxRuntimeLibrary& runtime, const maq::Bundle& bundle, const std::string& graph)
      : runtime_(runtime), spec_(bundle.manifest.graphs.at(graph)) {
    const std::vector<uint8_t>& bytes = bundle.files.at(spec_.file);
    OrtSessionOptions* options = nullptr;
    check(api().CreateSessionOptions(&options));
    check(api().SetIntraOpNumThreads(options, 1));
    check(api().SetSessionGraphOptimizationLevel(options, ORT_DISABLE_ALL));
    check(api().CreateSessionFromArray(runtime.env(), bytes.data(), bytes.size(), options, &session_));
    api().ReleaseSessionOptions(options);
    check(api().CreateCpuMemoryInfo(OrtDeviceAllocator, OrtMemTypeDefault, &memory_));
  }
  ~UnoptimisedGraph() {
    api().ReleaseMemoryInfo(memory_);
    api().ReleaseSession(session_);
  }
  UnoptimisedGraph(const UnoptimisedGraph&) = delete;
  UnoptimisedGraph& operator=(const UnoptimisedGraph&) = delete;

  Tensors run(const std::vector<maq::TensorView>& inputs) {
    std::vector<const char*> input_names, output_names;
    std::vector<const OrtValue*> values;
    for (size_t i = 0; i < inputs.size(); ++i) {
      input_names.push_back(spec_.inputs[i].name.c_str());
      size_t bytes = sizeof(float);
      for (const int64_t extent : inputs[i].shape) bytes *= size_t(extent);
      OrtValue* value = nullptr;
      check(api().CreateTensorWithDataAsOrtValue(memory_, const_cast<float*>(inputs[i].data), bytes,
                                                 inputs[i].shape.data(), inputs[i].shape.size(),
                                                 ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT, &value));
      values.push_back(value);
    }
    for (const maq::TensorSpec& output : spec_.outputs) output_names.push_back(output.name.c_str());
    std::vector<OrtValue*> results(output_names.size(), nullptr);
    check(api().Run(session_, nullptr, input_names.data(), values.data(), values.size(), output_names.data(),
                    output_names.size(), results.data()));
    Tensors outputs;
    for (OrtValue* result : results) {
      void* data = nullptr;
      check(api().GetTensorMutableData(result, &data));
      OrtTensorTypeAndShapeInfo* info = nullptr;
      check(api().GetTensorTypeAndShape(result, &info));
      size_t count = 0;
      check(api().GetTensorShapeElementCount(info, &count));
      api().ReleaseTensorTypeAndShapeInfo(info);
      outputs.emplace_back(static_cast<float*>(data), static_cast<float*>(data) + count);
      api().ReleaseValue(result);
    }
    for (const OrtValue* value : values) api().ReleaseValue(const_cast<OrtValue*>(value));
    return outputs;
  }

 private:
  const OrtApi& api() const { return runtime_.api(); }
  void check(OrtStatus* status) const { runtime_.check(status, MAQ_ERROR_INFERENCE, "The unoptimised graph failed"); }

  const maq::OnnxRuntimeLibrary& runtime_;
  maq::GraphSpec spec_;
  OrtSession* session_ = nullptr;
  OrtMemoryInfo* memory_ = nullptr;
};

size_t size_of(const maq::Shape& shape) {
  size_t size = 1;
  for (const int64_t extent : shape) size *= size_t(extent);
  return size;
}

Tensors copies(const std::vector<maq::TensorView>& views) {
  Tensors all;
  for (const maq::TensorView& view : views) all.emplace_back(view.data, view.data + size_of(view.shape));
  return all;
}

// Root mean square of a - b over that of a.
double relative_error(const std::vector<float>& a, const std::vector<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  double difference = 0, power = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    difference += (double(a[i]) - b[i]) * (double(a[i]) - b[i]);
    power += double(a[i]) * a[i];
  }
  return std::sqrt(difference / power);
}

// The largest index logit of each cell of the dense head's labels, cells of 15 coarse and 25 index logits.
std::vector<std::ptrdiff_t> best_parts(const std::vector<float>& labels) {
  constexpr std::ptrdiff_t kCoarse = 15, kIndex = 25;
  std::vector<std::ptrdiff_t> best;
  for (auto cell = labels.begin(); cell != labels.end(); cell += kCoarse + kIndex) {
    const auto index = cell + kCoarse;
    best.push_back(std::max_element(index, index + kIndex) - index);
  }
  return best;
}

maq::ImageView view_of(const cv::Mat& bgr) { return {MAQ_PIXEL_BGR8, bgr.cols, bgr.rows, {{bgr.data, bgr.step}, {}}}; }

cv::Mat one_colour(int width, int height, const cv::Scalar& colour) { return {height, width, CV_8UC3, colour}; }

cv::Mat checkerboard(int width, int height, int first) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at<cv::Vec3b>(y, x) = cv::Vec3b::all((x + y) % 2 == first ? 255 : 0);
  }
  return image;
}

class ShippedNetworks : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    runtime_ = std::make_shared<maq::OnnxRuntimeLibrary>(MAQ_TEST_ONNXRUNTIME, maq::Log());
    bundle_ = std::make_unique<maq::Bundle>(maq::read_bundle(MAQ_TEST_MODELS "/densepose-b-int8"));
    photo_ = cv::imread(MAQ_TEST_MEDIA "/photo.jpg");
    ASSERT_FALSE(photo_.empty());
  }
  static void TearDownTestSuite() {
    bundle_.reset();
    runtime_.reset();
  }

  static maq::DensePose make(const maq::DensePoseSettings& settings = {}) { return {runtime_, *bundle_, settings}; }

  static std::unique_ptr<maq::Session> session(const std::string& graph, int threads = 1) {
    const maq::GraphSpec& spec = bundle_->manifest.graphs.at(graph);
    return maq::open_session(runtime_, bundle_->files.at(spec.file), spec, graph, {threads});
  }

  static maq::DensePoseResult run(const cv::Mat& bgr, const maq::DensePoseSettings& settings = {}) {
    maq::DensePoseResult result;
    make(settings).run(view_of(bgr), result);
    return result;
  }

  // Boxes inside the frame, scores finite, planes consistent with each other and with the people.
  static void expect_sane(const maq::DensePoseResult& result, const cv::Mat& bgr) {
    ASSERT_EQ(result.planes.part.size(), bgr.total());
    std::vector<int64_t> pixels(result.people.size() + 1);
    for (size_t i = 0; i < result.planes.part.size(); ++i) {
      ASSERT_LE(result.planes.part[i], 24);
      ASSERT_LT(result.planes.person[i], pixels.size());
      ASSERT_EQ(result.planes.part[i] == 0, result.planes.person[i] == 0);
      ++pixels[result.planes.person[i]];
    }
    for (size_t k = 0; k < result.people.size(); ++k) {
      const maq::Box& box = result.people[k].box;
      EXPECT_TRUE(box.x0 >= 0 && box.y0 >= 0 && box.x1 <= float(bgr.cols) && box.y1 <= float(bgr.rows));
      EXPECT_TRUE(box.x0 < box.x1 && box.y0 < box.y1);
      EXPECT_TRUE(result.people[k].score > 0 && result.people[k].score <= 1);
      EXPECT_GT(pixels[k + 1], 0) << "person " << k;
    }
  }

  static constexpr int64_t kSide = 256;  // of the image that single graphs are asked about

  // The photo as the trunk takes it, [1, 3, kSide, kSide].
  static std::vector<float> trunk_input() {
    maq::NetworkInput input;
    maq::make_network_input(view_of(photo_), maq::network_size(photo_.cols, photo_.rows, int(kSide)),
                            maq::read_densepose_spec(bundle_->manifest).input, input);
    EXPECT_EQ(input.values.size(), size_t(3 * kSide * kSide));
    return input.values;
  }

  static std::vector<maq::Shape> trunk_shapes() {
    std::vector<maq::Shape> shapes;
    for (const int64_t stride : {4, 8, 16, 32, 64}) shapes.push_back({1, kSide / stride, kSide / stride, 64});
    shapes.push_back({1, kSide / 16, kSide / 16, 1});  // the evidence of people
    return shapes;
  }

  // Features of the photo at the finest level.
  static std::vector<float> finest_features() {
    const std::vector<float> image = trunk_input();
    const auto trunk = session("trunk");
    const maq::TensorView p2 = trunk->run({{image.data(), {1, 3, kSide, kSide}}}, trunk_shapes())[0];
    return {p2.data, p2.data + size_of(p2.shape)};
  }

  // `people` different boxes of the photo, pooled: [people, pool, pool, 64].
  static std::vector<float> rois(const std::vector<float>& features, int people, int pool) {
    const maq::FeatureMap map{features.data(), 64, int(kSide / 4), int(kSide / 4), 4};
    const size_t size = size_t(64) * size_t(pool) * size_t(pool);
    std::vector<float> pooled(size_t(people) * size);
    for (int k = 0; k < people; ++k) {
      const float shift = 3.0f * float(k);
      const maq::Box box{shift, 4 + shift / 2, 222 - shift, 256 - shift / 3};
      maq::RoiAlign().run(map, box, pool, pooled.data() + size_t(k) * size);
    }
    return pooled;
  }

  struct Head {
    const char* graph;
    int pool;
    std::vector<maq::Shape> outputs;  // for one person
  };
  static std::vector<Head> heads() {
    return {{"box_head", 7, {{1, 6}}}, {"dense_head", 32, {{1, 32, 32, 4 * (15 + 25)}, {1, 32, 32, 64}}}};
  }

  static std::vector<maq::Shape> for_people(std::vector<maq::Shape> shapes, int64_t people) {
    for (maq::Shape& shape : shapes) shape[0] = people;
    return shapes;
  }

  static std::shared_ptr<const maq::OnnxRuntimeLibrary> runtime_;
  static std::unique_ptr<maq::Bundle> bundle_;
  static cv::Mat photo_;
};

std::shared_ptr<const maq::OnnxRuntimeLibrary> ShippedNetworks::runtime_;
std::unique_ptr<maq::Bundle> ShippedNetworks::bundle_;
cv::Mat ShippedNetworks::photo_;

// Relative root mean squares. Unoptimised, each layer computes in float between two roundings to 8 bits; optimised, in
// integers with one rounding. Where they round to different sides a value moves by one step of 8 bits, and the layers
// that follow make more of it. Measured on an AVX-512 machine: 0.034 for the trunk, whose first blocks are float and
// whose fifty layers pass it on; 0 for the RPN and the heads.
constexpr double kMaxOptimisingErrorTrunk = 0.05, kMaxOptimisingError = 0.01;
// Maximum error of the person-logit map. Its root mean square over the cells is 0.2 to 0.4 on six photos. A box counts
// the mean of its cells.
constexpr double kMaxEvidenceError = 0.5;

TEST_F(ShippedNetworks, TheOptimisedTrunkAnswersAsTheUnoptimisedOne) {
  const std::vector<float> image = trunk_input();
  const std::vector<maq::TensorView> input = {{image.data(), {1, 3, kSide, kSide}}};
  const auto trunk = session("trunk");
  const Tensors optimised = copies(trunk->run(input, trunk_shapes()));
  const Tensors plain = UnoptimisedGraph(*runtime_, *bundle_, "trunk").run(input);
  ASSERT_EQ(optimised.size(), plain.size());
  ASSERT_EQ(optimised.size(), 6u);
  for (size_t l = 0; l < 5; ++l) {
    EXPECT_LE(relative_error(plain[l], optimised[l]), kMaxOptimisingErrorTrunk) << "p" << l + 2;
  }
  EXPECT_LE(cv::norm(plain[5], optimised[5], cv::NORM_L2) / std::sqrt(double(plain[5].size())), kMaxEvidenceError);
}

TEST_F(ShippedNetworks, TheOptimisedHeadsAnswerAsTheUnoptimisedOnes) {
  const std::vector<float> features = finest_features();
  for (const Head& head : heads()) {
    const std::vector<float> pooled = rois(features, 2, head.pool);
    const std::vector<maq::TensorView> input = {{pooled.data(), {2, head.pool, head.pool, 64}}};
    const auto optimised_head = session(head.graph);
    const Tensors optimised = copies(optimised_head->run(input, for_people(head.outputs, 2)));
    const Tensors plain = UnoptimisedGraph(*runtime_, *bundle_, head.graph).run(input);
    ASSERT_EQ(optimised.size(), plain.size());
    for (size_t i = 0; i < plain.size(); ++i) {
      EXPECT_LE(relative_error(plain[i], optimised[i]), kMaxOptimisingError) << head.graph << " output " << i;
    }
    if (std::string(head.graph) == "dense_head") {
      const std::vector<std::ptrdiff_t> a = best_parts(plain[0]), b = best_parts(optimised[0]);
      size_t equal = 0;
      for (size_t i = 0; i < a.size(); ++i) equal += a[i] == b[i];
      EXPECT_GE(double(equal) / double(a.size()), 0.995) << "parts, by the index logits of whole boxes";
    }
  }
}

TEST_F(ShippedNetworks, TheOptimisedRpnAnswersAsTheUnoptimisedOne) {
  const std::vector<float> features = finest_features();
  const std::vector<maq::TensorView> input = {{features.data(), {1, kSide / 4, kSide / 4, 64}}};
  const auto rpn = session("rpn_fine");
  const Tensors optimised = copies(rpn->run(input, {{1, kSide / 4, kSide / 4, 15}}));
  const Tensors plain = UnoptimisedGraph(*runtime_, *bundle_, "rpn_fine").run(input);
  for (size_t i = 0; i < plain.size(); ++i) EXPECT_LE(relative_error(plain[i], optimised[i]), kMaxOptimisingError) << i;
}

// The size of a batch chooses how matrices are cut into blocks, which may change the order of float sums: a few units
// in the last place of the largest value.
TEST_F(ShippedNetworks, ABatchOfPeopleIsAnsweredAsOneByOne) {
  constexpr int kPeople = 3;
  const std::vector<float> features = finest_features();
  for (const Head& head : heads()) {
    const std::vector<float> pooled = rois(features, kPeople, head.pool);
    const size_t roi_size = pooled.size() / kPeople;
    const auto network = session(head.graph);
    const Tensors batch =
        copies(network->run({{pooled.data(), {kPeople, head.pool, head.pool, 64}}}, for_people(head.outputs, kPeople)));
    for (size_t k = 0; k < kPeople; ++k) {
      const Tensors alone =
          copies(network->run({{pooled.data() + k * roi_size, {1, head.pool, head.pool, 64}}}, head.outputs));
      for (size_t i = 0; i < alone.size(); ++i) {
        const std::vector<float>& all = batch[i];
        const float largest = std::abs(
            *std::max_element(all.begin(), all.end(), [](float x, float y) { return std::abs(x) < std::abs(y); }));
        for (size_t j = 0; j < alone[i].size(); ++j) {
          ASSERT_NEAR(all[k * alone[i].size() + j], alone[i][j], 1e-6f * largest)
              << head.graph << " output " << i << " person " << k;
        }
      }
    }
  }
}

// The photo rotated clockwise about its middle, on a grey frame around it, and the way back to the photo.
struct RotatedPhoto {
  RotatedPhoto(const cv::Mat& photo, double degrees) {
    const double angle = degrees * CV_PI / 180;
    const double width = photo.cols * std::abs(std::cos(angle)) + photo.rows * std::abs(std::sin(angle));
    const double height = photo.cols * std::abs(std::sin(angle)) + photo.rows * std::abs(std::cos(angle));
    const cv::Size size(int(std::ceil(width - 1e-6)), int(std::ceil(height - 1e-6)));
    into = cv::getRotationMatrix2D({float(photo.cols - 1) / 2, float(photo.rows - 1) / 2}, -degrees, 1);
    into.at<double>(0, 2) += (size.width - photo.cols) / 2.0;
    into.at<double>(1, 2) += (size.height - photo.rows) / 2.0;
    cv::warpAffine(photo, bgr, into, size, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar::all(116));
  }

  cv::Mat bgr;
  cv::Mat into;  // from the photo
};

// Fraction of the pixels with the same part in both results, among pixels that show a body in either result.
double same_parts(const maq::DensePoseResult& upright, const maq::DensePoseResult& rotated, const cv::Mat& into) {
  const auto plane = [](const maq::DensePoseResult& result) {
    return cv::Mat(result.planes.height_px, result.planes.width_px, CV_8U,
                   const_cast<uint8_t*>(result.planes.part.data()));
  };
  const cv::Mat first = plane(upright);
  cv::Mat back;
  cv::warpAffine(plane(rotated), back, into, first.size(), cv::INTER_NEAREST | cv::WARP_INVERSE_MAP);
  const int same = cv::countNonZero((first == back) & (first != 0));
  return double(same) / cv::countNonZero((first != 0) | (back != 0));
}

TEST_F(ShippedNetworks, AFrameOfACameraHeldAskewIsMappedAsIfItStoodUprightOnceTheRollIsTold) {
  for (const maq::PersonCrops crops : {maq::PersonCrops::kOff, maq::PersonCrops::kAll}) {
    maq::DensePoseSettings settings;
    settings.crops = crops;
    const maq::DensePoseResult upright = run(photo_, settings);
    ASSERT_EQ(upright.people.size(), 1u);
    maq::DensePose densepose = make(settings);
    for (const double degrees : {-30.0, 45.0, 90.0, -90.0, 130.0, 180.0}) {
      const RotatedPhoto photo(photo_, degrees);
      maq::DensePoseResult untold, told;
      densepose.set_roll(0);
      densepose.run(view_of(photo.bgr), untold);
      densepose.set_roll(float(degrees * CV_PI / 180));
      densepose.run(view_of(photo.bgr), told);
      expect_sane(told, photo.bgr);
      ASSERT_EQ(told.people.size(), 1u) << degrees;
      EXPECT_GT(same_parts(upright, told, photo.into), 0.7) << degrees;
      // At 30 degrees the networks, which are trained on people who lean, do as well without the roll.
      if (std::abs(degrees) >= 45) {
        EXPECT_GT(same_parts(upright, told, photo.into), same_parts(upright, untold, photo.into)) << degrees;
      }
      EXPECT_NEAR(told.people[0].score, upright.people[0].score, 0.05) << degrees;
    }
  }
}

TEST_F(ShippedNetworks, ARollBeginsAKeyFrameWhereItsStepChanges) {
  maq::DensePoseSettings settings;
  settings.key_frame_interval = 100;
  maq::DensePose densepose = make(settings);
  const auto is_key_frame = [&](double degrees) {
    maq::DensePoseResult result;
    densepose.set_roll(float(degrees * CV_PI / 180));
    densepose.run(view_of(photo_), result);
    return result.stats.key_frame;
  };
  EXPECT_TRUE(is_key_frame(0));
  EXPECT_FALSE(is_key_frame(7));
  EXPECT_TRUE(is_key_frame(8));
  EXPECT_FALSE(is_key_frame(22));
  EXPECT_TRUE(is_key_frame(-5));
}

TEST_F(ShippedNetworks, InAStillStreamFewerLabelsChangeThanInSingleImagesWithCropsToo) {
  // The share of body pixels whose part changes from one frame to the next, with the noise of a sensor.
  const auto flips = [&](const maq::DensePoseSettings& settings, bool is_stream) {
    maq::DensePose densepose = make(settings);
    cv::RNG random(1);
    cv::Mat noise(photo_.size(), CV_16SC3), noisy;
    std::vector<uint8_t> before;
    double changed = 0, body = 0;
    for (int frame = 0; frame < 9; ++frame) {
      random.fill(noise, cv::RNG::NORMAL, 0, 6);
      cv::add(photo_, noise, noisy, cv::noArray(), CV_8U);
      maq::DensePoseResult result;
      densepose.run(view_of(noisy), result, {is_stream, {}});
      const std::vector<uint8_t>& part = result.planes.part;
      for (size_t i = 0; i < before.size(); ++i) {
        if (before[i] == 0 || part[i] == 0) continue;
        ++body;
        changed += before[i] != part[i];
      }
      before = part;
    }
    EXPECT_GT(body, 8 * 0.2 * double(photo_.total()));
    return changed / std::max(body, 1.0);
  };
  maq::DensePoseSettings settings;
  const double single = flips(settings, false), stream = flips(settings, true);
  settings.crops = maq::PersonCrops::kAll;
  settings.key_frame_interval = 4;
  const double crops = flips(settings, true);
  RecordProperty("flips", std::to_string(single) + " " + std::to_string(stream) + " " + std::to_string(crops));
  EXPECT_LT(stream, 0.5 * single);
  EXPECT_LT(crops, 0.5 * single);
}

TEST_F(ShippedNetworks, APersonAtTheThresholdStaysInAStreamAndNobodyAppearsThere) {
  // The photo, ever less of it, until the score is a little lower.
  cv::Mat faint;
  float score = 1;
  for (double contrast = 0.9; score > 0.97f && contrast > 0.02; contrast *= 0.9) {
    photo_.convertTo(faint, CV_8U, contrast, 127 * (1 - contrast));
    maq::DensePoseResult result;
    make().run(view_of(faint), result);
    ASSERT_EQ(result.people.size(), 1u) << contrast;
    score = result.people[0].score;
  }
  for (const int key_frame_interval : {1, 4}) {
    maq::DensePoseSettings settings;
    settings.score_threshold = score + 0.01f;
    settings.key_frame_interval = key_frame_interval;
    maq::DensePose densepose = make(settings);
    const auto people = [&](const cv::Mat& image) {
      maq::DensePoseResult result;
      densepose.run(view_of(image), result, {true, {}});
      return result.people.size();
    };
    EXPECT_EQ(people(faint), 0u) << "nobody was there";
    densepose.reset();
    EXPECT_EQ(people(photo_), 1u);
    for (int frame = 0; frame < 5; ++frame) EXPECT_EQ(people(faint), 1u);
    EXPECT_EQ(people(one_colour(photo_.cols, photo_.rows, cv::Scalar::all(90))), 0u) << "gone";
    densepose.reset();
    EXPECT_EQ(people(faint), 0u) << "another stream";
  }
}

TEST_F(ShippedNetworks, FramesOfOneColourAndCheckerboardsShowNoPeople) {
  maq::DensePose densepose = make();
  maq::DensePoseResult result;
  const auto expect_no_people = [&](const cv::Mat& image, const char* what) {
    densepose.run(view_of(image), result);
    EXPECT_EQ(result.people.size(), 0u) << what;
    expect_sane(result, image);
  };
  expect_no_people(one_colour(320, 256, cv::Scalar::all(0)), "black");
  expect_no_people(one_colour(320, 256, cv::Scalar::all(255)), "white");
  expect_no_people(one_colour(256, 320, cv::Scalar::all(128)), "grey");
  expect_no_people(one_colour(320, 256, cv::Scalar(0, 0, 255)), "red");
  expect_no_people(one_colour(256, 320, cv::Scalar(110, 140, 210)), "skin");
  expect_no_people(checkerboard(288, 256, 0), "checkerboard at the network's own size");
  expect_no_people(checkerboard(256, 288, 1), "the other one");
  expect_no_people(checkerboard(640, 480, 0), "a checkerboard that is shrunk");
}

TEST_F(ShippedNetworks, NoiseShowsAPersonInAtMostOneFrameOfAHundred) {
  maq::DensePose densepose = make();
  maq::DensePoseResult result;
  cv::RNG random(1);
  int frames_with_people = 0;
  for (int k = 0; k < 100; ++k) {
    cv::Mat image(256, 320, CV_8UC3);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    densepose.run(view_of(image), result);
    frames_with_people += !result.people.empty();
    expect_sane(result, image);
  }
  EXPECT_LE(frames_with_people, 1);
}

// The planes of 4 bytes a pixel are the result; besides them nothing may grow with the frame.
TEST_F(ShippedNetworks, AFrameOf33MegapixelsTakesLittleMoreMemoryThanItsResult) {
  cv::Mat image;
  cv::resize(photo_, image, cv::Size(7680, 4320));
  maq::DensePose densepose = make();
  maq::DensePoseResult result;
  densepose.run(view_of(photo_), result);  // the networks' own memory
  const auto peak_mib = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
  };
  const double before = peak_mib();
  densepose.run(view_of(image), result);
  expect_sane(result, image);
  EXPECT_EQ(result.people.size(), 1u) << "the person of the photo, stretched";
  const double planes_mib = 4.0 * double(image.total()) / (1 << 20);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  (void)before, (void)planes_mib;  // sanitizers keep freed memory
#else
  EXPECT_LE(peak_mib() - before, planes_mib + 64);
#endif
}

TEST_F(ShippedNetworks, PeopleHaveACropIfTheyAreSmallInTheNetworkOrLean) {
  maq::DensePoseSettings settings;
  settings.crops = maq::PersonCrops::kAuto;
  const maq::DensePoseResult upright = run(photo_, settings);
  ASSERT_EQ(upright.people.size(), 1u);
  EXPECT_EQ(upright.stats.crops, 0);
  EXPECT_EQ(upright.planes.part, run(photo_).planes.part);

  cv::Mat leaning;
  const cv::Point2f middle(float(photo_.cols) / 2, float(photo_.rows) / 2);
  cv::warpAffine(photo_, leaning, cv::getRotationMatrix2D(middle, 45, 0.8), photo_.size());
  const maq::DensePoseResult rotated = run(leaning, settings);
  EXPECT_GE(rotated.stats.crops, 1);
  expect_sane(rotated, leaning);

  // At 64 pixels a crop labels .064 to .071 more of the pixels as the full input does, with and without noise of one
  // level. At 96 it is .001 to .009, -.008 when the photo is moved by four pixels, -.002 by the rounding of aarch64.
  settings.long_side_px = 64;
  const maq::DensePoseResult small = run(photo_, settings);
  EXPECT_EQ(small.stats.crops, 1);
  settings.crops = maq::PersonCrops::kOff;
  const maq::DensePoseResult coarse = run(photo_, settings);
  const auto agreement = [&](const maq::DensePoseResult& result) {
    size_t equal = 0;
    for (size_t i = 0; i < photo_.total(); ++i) equal += result.planes.part[i] == upright.planes.part[i];
    return double(equal) / double(photo_.total());
  };
  EXPECT_GT(agreement(small), agreement(coarse) + 0.03) << "with a crop the small input labels as the large one";
}

TEST_F(ShippedNetworks, ThePersonIsFoundWhenTruncatedByEachBorderAndWhenFillingTheFrame) {
  // The astronaut: head at the top, cut by the lower and left borders already.
  const maq::DensePoseResult whole = run(photo_);
  ASSERT_EQ(whole.people.size(), 1u);
  const maq::PixelRect box = maq::pixel_rect(whole.people[0].box);
  const cv::Rect person(box.x, box.y, box.width, box.height);
  const int w = person.width, h = person.height;
  for (const cv::Rect& part : {
           person, cv::Rect(person.x + w / 4, person.y, 3 * w / 4, h),  // cut at the left
           cv::Rect(person.x, person.y, 3 * w / 4, h),                  // at the right
           cv::Rect(person.x, person.y + h / 5, w, h - h / 5),          // at the top
           cv::Rect(person.x, person.y, w, 3 * h / 4),                  // at the bottom
       }) {
    const cv::Mat image = photo_(part).clone();
    const maq::DensePoseResult result = run(image);
    EXPECT_GE(result.people.size(), 1u) << part;
    expect_sane(result, image);
  }
}

}  // namespace
