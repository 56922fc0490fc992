#include <gtest/gtest.h>

#include <maquette/maquette.hpp>
#include <set>

namespace {

TEST(ApiSources, EverySchemeOfTheListHasAnExampleThatIsKnown) {
  const maquette::Context context;
  std::set<std::string> names;
  for (uint32_t i = 0; i < maq_source_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    ASSERT_EQ(maq_source_get_scheme(i, &scheme), MAQ_OK);
    names.insert(scheme.name);
    maq_source* source = nullptr;
    const maq_status status = maq_source_create(context.get(), scheme.example, nullptr, &source);
    EXPECT_TRUE(status == MAQ_OK || status == MAQ_ERROR_NOT_FOUND) << maq_last_error(context.get());
    maq_source_destroy(source);
  }
  EXPECT_EQ(names, (std::set<std::string>{"image", "stub", "video"}));
  maq_source_scheme scheme{};
  scheme.struct_size = sizeof scheme;
  EXPECT_EQ(maq_source_get_scheme(maq_source_scheme_count(), &scheme), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST(ApiSources, DescribeThemselvesAndDeliverUntilTheEnd) {
  const maquette::Context context;
  maquette::Source source(context, "stub:people?frames=2&size=64x48&fps=10");
  const maq_source_info info = source.info();
  EXPECT_EQ(info.width_px, 64);
  EXPECT_EQ(info.frame_count, 2);
  EXPECT_DOUBLE_EQ(info.fps, 10);
  EXPECT_EQ(info.is_live, 0);
  EXPECT_EQ(info.clock, MAQ_CLOCK_MEDIA);
  EXPECT_EQ(info.pool_size, 4u);
  EXPECT_TRUE(source.next().has_value());
  EXPECT_EQ(source.next()->desc().timestamp_ns, 100000000);
  EXPECT_FALSE(source.next().has_value());
}

TEST(ApiSources, SayWhenEveryFrameIsHeld) {
  const maquette::Context context;
  maquette::Source source(context, "stub:pattern?size=16x16");
  std::vector<maquette::Frame> held;
  for (int i = 0; i < 4; ++i) held.push_back(*source.next());
  maq_frame* frame = nullptr;
  EXPECT_EQ(maq_source_acquire_frame(source.get(), 0, &frame), MAQ_ERROR_POOL_EMPTY);
  EXPECT_EQ(frame, nullptr);
  held.pop_back();
  EXPECT_TRUE(source.next().has_value());
}

TEST(ApiSources, UnknownSchemesAndMissingFilesAreSentences) {
  const maquette::Context context;
  maq_source* source = nullptr;
  EXPECT_EQ(maq_source_create(context.get(), "rtsp:camera", nullptr, &source), MAQ_ERROR_UNSUPPORTED);
  EXPECT_STREQ(maq_last_error(context.get()),
               "\"rtsp:\" is not a kind of source of this build; there are image:, video:, stub:.");
  EXPECT_EQ(maq_source_create(context.get(), "image:/no/such.jpg", nullptr, &source), MAQ_ERROR_NOT_FOUND);
  EXPECT_STREQ(maq_last_error(context.get()), "/no/such.jpg does not exist; check the path.");
  EXPECT_EQ(source, nullptr);
}

}  // namespace
