// The `maquette` program as a person meets it: output, exit codes, and files that are whole or not there.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>

#include "support/program_run.h"
#include "support/samples/bundle_copy.h"

namespace {

class CommandLine : public ::testing::Test {
 protected:
  CommandLine() {
    cv::Mat image = cv::Mat::zeros(256, 320, CV_8UC3);
    image(cv::Rect(80, 100, 4, 4)) = cv::Scalar(0, 0, 255);
    image(cv::Rect(200, 128, 8, 8)) = cv::Scalar(0, 255, 0);
    cv::imwrite(folder_.file("two.png"), image);
  }

  Outcome run(const std::string& arguments) {
    return run_program(folder_, "MAQ_BUNDLE=" + bundle_ + " " + environment_, arguments);
  }

  // The failure is one sentence on standard error that contains `text`, the exit code is 1 and nothing is written.
  void expect_failure(const std::string& arguments, const std::string& text) {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(written_files().empty()) << arguments;
  }

  std::set<std::string> written_files() const {
    std::set<std::string> names;
    if (!std::filesystem::exists(folder_.file("o"))) return names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.file("o"))) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }

  std::string write_clip(const std::string& name, int frames) {
    cv::VideoWriter writer(folder_.file(name), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10, cv::Size(64, 48));
    for (int k = 0; k < frames; ++k) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(8 * k)));
    return folder_.file(name);
  }

  TempFolder folder_;
  std::string bundle_ = "'" MAQ_TEST_DATA "/tiny_bundle'";
  std::string environment_;
};

TEST_F(CommandLine, WritesTheFilesOfAnImageAndSaysWhatItFound) {
  const Outcome result = run("densepose image:two.png --out o --overlay");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("two  320 x 256  2 people"), std::string::npos) << result.out;
  EXPECT_EQ(written_files(), (std::set<std::string>{"two.json", "two_INDS.png", "two_IUV.png", "two_overlay.png"}));

  const cv::Mat iuv = cv::imread(folder_.file("o/two_IUV.png"), cv::IMREAD_UNCHANGED);
  const cv::Mat inds = cv::imread(folder_.file("o/two_INDS.png"), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(iuv.size(), cv::Size(320, 256));
  ASSERT_EQ(iuv.type(), CV_8UC3);
  ASSERT_EQ(inds.type(), CV_8UC1);
  EXPECT_EQ(iuv.at<cv::Vec3b>(110, 70)[0], 3) << "the left half of the first person";
  EXPECT_EQ(iuv.at<cv::Vec3b>(110, 95)[0], 7) << "the right half";
  EXPECT_LT(iuv.at<cv::Vec3b>(110, 72)[1], iuv.at<cv::Vec3b>(110, 94)[1]) << "U rises to the right";
  EXPECT_LT(iuv.at<cv::Vec3b>(96, 72)[2], iuv.at<cv::Vec3b>(112, 72)[2]) << "V rises downwards";
  EXPECT_EQ(inds.at<uint8_t>(110, 70), 1);
  EXPECT_EQ(inds.at<uint8_t>(140, 200), 2);
  EXPECT_EQ(inds.at<uint8_t>(5, 5), 0);

  const auto json = nlohmann::json::parse(read_text(folder_.file("o/two.json")));
  EXPECT_EQ(json.size(), 3u);
  EXPECT_EQ(json["width"], 320);
  EXPECT_EQ(json["height"], 256);
  ASSERT_EQ(json["people"].size(), 2u);
  EXPECT_NEAR(json["people"][0]["box"][0].get<double>(), 67, 1);
  EXPECT_GT(json["people"][0]["score"].get<double>(), 0.9);
}

TEST_F(CommandLine, ImagesGetCropsAndClipsDoNotUnlessAPresetIsNamed) {
  write_clip("clip.avi", 2);
  const auto crops = [&](const std::string& arguments) {
    const Outcome result = run("densepose --json --out o " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out.substr(0, result.out.find('\n'))).at("crops").get<int>();
  };
  EXPECT_EQ(crops("two.png"), 2);
  EXPECT_EQ(crops("clip.avi"), 0);
  EXPECT_EQ(crops("two.png --preset stream"), 0);
  EXPECT_EQ(crops("two.png --crops off"), 0);
}

TEST_F(CommandLine, TakesABarePathAndNamesWithOddCharacters) {
  std::filesystem::copy(folder_.file("two.png"), folder_.file("what? 50%25.png"));
  EXPECT_EQ(run("densepose two.png --out o").exit_code, 0);
  EXPECT_EQ(run("densepose 'what? 50%25.png' --out o").exit_code, 0);
  EXPECT_EQ(written_files().count("what? 50%25_IUV.png"), 1u);
  write_clip("clip.avi", 3);
  std::filesystem::rename(folder_.file("clip.avi"), folder_.file("clip.data"));
  EXPECT_EQ(run("densepose clip.data --out o").exit_code, 0) << "a clip is known by its content";
  EXPECT_EQ(written_files().count("clip_000002.json"), 1u);
}

TEST_F(CommandLine, WritesEveryFrameOfAClipAndItsOverlay) {
  write_clip("clip.avi", 6);
  const Outcome result = run("densepose video:clip.avi --out o --overlay --every 2");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::set<std::string> files = written_files();
  EXPECT_EQ(files.size(), 3u * 3 + 1);
  EXPECT_EQ(files.count("clip_000004_IUV.png"), 1u);
  EXPECT_EQ(files.count("clip_000003_IUV.png"), 0u);
  cv::VideoCapture overlay(folder_.file("o/clip_overlay.mp4"));
  cv::Mat frame;
  int frames = 0;
  while (overlay.read(frame)) ++frames;
  EXPECT_EQ(frames, 3);
}

TEST_F(CommandLine, StopsAStubAfterTheFramesAskedFor) {
  EXPECT_EQ(run("densepose 'stub:people?size=160x120' --out o --max-frames 4").exit_code, 0);
  EXPECT_EQ(written_files().size(), 12u);
}

TEST_F(CommandLine, PrintsJsonLinesWhenAsked) {
  const Outcome result = run("densepose two.png --out o --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto line = nlohmann::json::parse(result.out);
  EXPECT_EQ(line["frame"], "two");
  EXPECT_EQ(line["people"], 2);
  EXPECT_GT(line["ms"]["total"].get<double>(), 0);
}

TEST_F(CommandLine, ThreadsAreANumberOrMeasured) {
  const auto line_of = [&](const std::string& threads) {
    const Outcome result = run("densepose two.png --out o --json --threads " + threads);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out);
  };
  const auto fixed = line_of("2"), measured = line_of("measured");
  EXPECT_EQ(fixed["threads"], 2);
  EXPECT_EQ(fixed["threads_measured"], false);
  EXPECT_GE(measured["threads"], 1);
  EXPECT_LE(measured["threads"], 4);
  EXPECT_EQ(measured["threads_measured"], true);
  for (const char* wrong : {"0", "65", "-1", "many", "measure"}) {
    const Outcome result = run(std::string("densepose two.png --out other --threads ") + wrong);
    EXPECT_NE(result.exit_code, 0) << wrong;
    EXPECT_NE(result.err.find(std::string(wrong) + " is neither 1 to 64 nor \"measured\""), std::string::npos)
        << result.err;
  }
}

TEST_F(CommandLine, BadImagesAreOneSentenceAndNothingIsWritten) {
  expect_failure("densepose none.jpg --out o", "none.jpg does not exist; check the path");
  expect_failure("densepose image:none.jpg --out o", "none.jpg does not exist; check the path");
  write_text(folder_.file("text.jpg"), "not an image");
  expect_failure("densepose text.jpg --out o", "text.jpg cannot be decoded");
  write_text(folder_.file("empty.png"), "");
  expect_failure("densepose empty.png --out o", "empty.png is empty");
  std::string huge = read_text(folder_.file("two.png"));
  huge[17] = 0x7f;
  write_text(folder_.file("huge.png"), huge);
  expect_failure("densepose huge.png --out o", "over the limit of 16384");
  expect_failure("densepose rtsp:host --out o", "\"rtsp:\" is not a kind of source");
  expect_failure("densepose 'stub:people?size=0x0' --out o", "at least one pixel");
  expect_failure("densepose . --out o", "is a folder");
}

TEST_F(CommandLine, BadBundlesAreOneSentenceAndNothingIsWritten) {
  const BundleCopy changed;
  changed.flip_byte("dense_head.onnx");
  expect_failure("densepose two.png --out o --bundle '" + changed.path() + "'", "dense_head.onnx has SHA-256");
  expect_failure("densepose two.png --out o --bundle nowhere", "Model bundle nowhere is not a folder");
  expect_failure("densepose two.png --out o --bundle .", "no manifest.json");
  const BundleCopy reshaped;
  nlohmann::json manifest = reshaped.manifest();
  manifest["graphs"]["box_head"]["outputs"][0]["shape"][1] = 3;
  reshaped.write_manifest(manifest);
  expect_failure("densepose two.png --out o --bundle '" + reshaped.path() + "'",
                 "output boxes must have the shape [n, 6]");
}

TEST_F(CommandLine, ATruncatedClipKeepsItsWholeFramesAndNoOverlay) {
  const std::string whole = read_text(write_clip("clip.avi", 60));
  write_text(folder_.file("cut.avi"), whole.substr(0, whole.size() / 2));
  const Outcome result = run("densepose cut.avi --out o --overlay");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("truncated"), std::string::npos) << result.err;
  const std::set<std::string> files = written_files();
  EXPECT_FALSE(files.empty());
  EXPECT_EQ(files.size() % 3, 0u) << "three files a frame";
  EXPECT_EQ(files.count("cut_overlay.mp4"), 0u);
  for (const std::string& name : files) EXPECT_NE(name[0], '.') << "left over: " << name;
}

TEST_F(CommandLine, OneBadFileOfABatchCostsOnlyItself) {
  const Outcome result = run("densepose none.jpg two.png --out o");
  EXPECT_EQ(result.exit_code, 1);
  const Outcome missing_uri = run("densepose image:none.jpg two.png --out o");
  EXPECT_EQ(missing_uri.exit_code, 1);
  EXPECT_EQ(written_files().size(), 3u);
  std::filesystem::create_directory(folder_.file("d"));
  std::filesystem::copy(folder_.file("two.png"), folder_.file("d/two.png"));
  const Outcome same_name = run("densepose two.png d/two.png --out o");
  EXPECT_EQ(same_name.exit_code, 1);
  EXPECT_NE(same_name.err.find("Two sources"), std::string::npos);
}

TEST_F(CommandLine, AFolderThatCannotBeWrittenIsNamed) {
  write_text(folder_.file("o"), "a file where the folder should be");
  const Outcome result = run("densepose two.png --out o");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("o/two_IUV.png cannot be written"), std::string::npos) << result.err;
}

TEST_F(CommandLine, MeasuresItsSourcesAndWritesDownEverything) {
  write_clip("clip.avi", 4);
  const Outcome result =
      run("bench image:two.png clip.avi --runs 12 --seconds 0 --warm-up 1 --provider xnnpack --threads measured "
          "--json bench.json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("image:two.png"), std::string::npos) << result.out;
  const auto document = nlohmann::json::parse(read_text(folder_.file("bench.json")));
  EXPECT_EQ(document.at("schema"), "maquette-bench-3");
  EXPECT_GE(document.at("machine").at("cores"), 1);
  EXPECT_GT(document.at("machine").at("memory_mib"), 100);
  EXPECT_GT(document.at("start_to_first_result_ms"), document.at("first_frame_ms"));
  EXPECT_GT(document.at("peak_memory_mib"), 1);
  EXPECT_EQ(document.at("valid"), document.at("warnings").empty());
  ASSERT_EQ(document.at("cases").size(), 2U);
  EXPECT_EQ(document.at("settings").at("provider"), "xnnpack");
  EXPECT_EQ(document.at("settings").at("threads"), "measured");
  EXPECT_NE(result.out.find("Threads, measured: "), std::string::npos) << result.out;
  for (const auto& timed : document.at("cases")) {
    EXPECT_EQ(timed.at("provider"), "cpu") << "in use: ONNX Runtime for Linux has no other";
    EXPECT_GE(timed.at("threads"), 1);
    EXPECT_EQ(timed.at("threads_measured"), true);
    EXPECT_GE(timed.at("runs"), 12);  // the clip of four frames is begun anew
    EXPECT_EQ(timed.at("dropped_frames"), 0);
    EXPECT_GT(timed.at("cpu_ms"), 0);
    double stages = 0;
    for (const auto& [name, ms] : timed.at("ms").items()) {
      EXPECT_LE(ms.at("p50"), ms.at("p90")) << name;
      EXPECT_LE(ms.at("p90"), ms.at("p99")) << name;
      if (name != "frame") stages += ms.at("p50").get<double>();
    }
    EXPECT_LT(stages, 1.5 * timed.at("ms").at("frame").at("p90").get<double>());
  }
  EXPECT_EQ(document.at("cases")[0].at("people"), 2);
  EXPECT_EQ(document.at("cases")[1].at("size_px"), (nlohmann::json{64, 48}));
}

TEST_F(CommandLine, WhatCannotBeMeasuredIsOneSentence) {
  expect_failure("bench image:two.png none.jpg --runs 1 --seconds 0 --json bench.json", "none.jpg does not exist");
  expect_failure("bench image:two.png --bundle nowhere --runs 1 --seconds 0 --json bench.json", "nowhere");
}

TEST_F(CommandLine, RecordsPlaysAndMeasures) {
  const Outcome recorded = run("record 'stub:people?size=320x256&fps=50' take.maqrec --seconds 1");
  EXPECT_EQ(recorded.exit_code, 0) << recorded.err;
  EXPECT_NE(recorded.out.find("take.maqrec: 50 frames, 1.0 s"), std::string::npos) << recorded.out;
  const Outcome played = run("play take.maqrec --speed 2 --json figures.json");
  EXPECT_EQ(played.exit_code, 0) << played.err;
  EXPECT_EQ(played.out.find('\x1b'), std::string::npos) << "no pictures where no terminal is";
  const auto figures = nlohmann::json::parse(read_text(folder_.file("figures.json")));
  EXPECT_EQ(figures["frames"].get<int>() + figures["dropped_frames"].get<int>(), 50);
  EXPECT_NEAR(figures["nominal_fps"].get<double>(), 100, 0.1);
  EXPECT_GT(figures["age_ms"]["median"].get<double>(), 0);
  EXPECT_EQ(figures["events"][0]["state"], "started");
  const Outcome posed = run("densepose take.maqrec --out o --max-frames 2");
  EXPECT_EQ(posed.exit_code, 0) << posed.err;
  EXPECT_EQ(written_files().count("take_000001_IUV.png"), 1u);

  const Outcome again = run("record 'stub:people?frames=5' take.maqrec");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("never written over"), std::string::npos) << again.err;
  const Outcome endless = run("record stub:people other.maqrec");
  EXPECT_NE(endless.err.find("--frames or --seconds"), std::string::npos) << endless.err;
  EXPECT_FALSE(std::filesystem::exists(folder_.file("other.maqrec")));
}

TEST_F(CommandLine, RecordsAndPlaysDepthAndRefusesItAsAPicture) {
  const Outcome recorded =
      run("record 'stub:solids?scene=room&noise=tof&size=64x48' take.maqrec --frames 5 --quality 90");
  EXPECT_EQ(recorded.exit_code, 0) << recorded.err;
  const Outcome played = run("play take.maqrec");
  EXPECT_EQ(played.exit_code, 0) << played.err;
  EXPECT_NE(played.out.find("5 frames of 64 x 48"), std::string::npos) << played.out;
  const Outcome posed = run("densepose take.maqrec --out o");
  EXPECT_EQ(posed.exit_code, 1);
  EXPECT_NE(posed.err.find("A depth image has no colours"), std::string::npos) << posed.err;
}

TEST_F(CommandLine, PlayTellsOfLossAndReturnAndOfWhatStaysAway) {
  const Outcome played = run("play 'stub:pattern?frames=60&fps=100&unplug=100ms@200ms&drop=0.2' --json figures.json");
  EXPECT_EQ(played.exit_code, 0) << played.err;
  const auto figures = nlohmann::json::parse(read_text(folder_.file("figures.json")));
  std::vector<std::string> states;
  for (const auto& event : figures["events"]) states.push_back(event["state"]);
  EXPECT_EQ(states, (std::vector<std::string>{"started", "lost", "reconnecting", "reconnected"}));
  EXPECT_GT(figures["dropped_frames"].get<int>(), 0);
  const Outcome dropped = run("play 'stub:pattern?frames=5&fps=100&drop=1'");
  EXPECT_EQ(dropped.exit_code, 1);
  EXPECT_NE(dropped.err.find("delivered no frame"), std::string::npos) << dropped.err;
  const Outcome lost = run("play v4l2:/dev/video77");
  EXPECT_EQ(lost.exit_code, 1);
  EXPECT_NE(lost.err.find("plugged in"), std::string::npos) << lost.err;
}

TEST_F(CommandLine, ADamagedRecordingPlaysWithoutItsDamagedFrames) {
  run("record 'stub:pattern?frames=5&size=64x48' take.maqrec");
  std::string bytes = read_text(folder_.file("take.maqrec"));
  write_text(folder_.file("cut.maqrec"), bytes.substr(0, bytes.size() / 2));
  const Outcome played = run("play cut.maqrec");
  EXPECT_EQ(played.exit_code, 0);
  EXPECT_NE(played.out.find("2 frames"), std::string::npos) << played.out;
  EXPECT_NE(played.err.find("2 whole frames were found"), std::string::npos) << played.err;
}

TEST_F(CommandLine, TheDoctorSaysWhatToDo) {
  const Outcome result = run("doctor");
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1);
  EXPECT_NE(result.out.find("cameras can be used"), std::string::npos) << result.out;
  if (result.exit_code == 1) {
    EXPECT_NE(result.out.find("->"), std::string::npos) << result.out;
  }
}

TEST_F(CommandLine, TheDoctorReadsTheNetworksOfEachSystemAndTellsTheirPrecisionAndSize) {
  environment_ = "MAQ_SCENE_BUNDLE='" MAQ_TEST_DATA "/tiny_scene/bundle'";
  const Outcome result = run("doctor");
  for (const char* text : {"ok    densepose: fp32, 0.", "tiny_bundle\n", "ok    scenes: ", "tiny_scene/bundle\n",
                           "ok    edges: int8, 1.4 MB  ", "/models/edges-int8\n", "ok    heads: int8, 4.0 MB  ",
                           "ok    prediction: int8, 6.0 MB  "}) {
    EXPECT_NE(result.out.find(text), std::string::npos) << text << result.out;
  }
}

TEST_F(CommandLine, TheDoctorTellsDamagedNetworksAndItsExitCodeIsOne) {
  const BundleCopy damaged;
  damaged.flip_byte("trunk.onnx");
  bundle_ = damaged.path();
  const Outcome result = run("doctor");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.out.find("BAD   densepose: "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("trunk.onnx"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("-> install the networks again, or see MAQ_BUNDLE"), std::string::npos) << result.out;
}

TEST_F(CommandLine, TheDoctorFindsTheProgramThatReadsClipsOrSaysHowToGetIt) {
  const std::string program = folder_.file("decoder's");
  write_text(program, "#!/bin/sh\necho 'ffmpeg version 9.1-x Copyright (c) the developers'\necho more\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  environment_ = "MAQ_FFMPEG=\"" + program + "\"";
  Outcome result = run("doctor");
  EXPECT_NE(result.out.find("ffmpeg 9.1-x reads them  " + program), std::string::npos) << result.out;

  environment_ = "MAQ_FFMPEG=/no/such";
  result = run("doctor");
  EXPECT_NE(result.out.find("MAQ_FFMPEG names /no/such, which is no program"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("apt install ffmpeg"), std::string::npos) << result.out;

  write_text(program, "#!/bin/sh\necho hello\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  environment_ = "MAQ_FFMPEG=\"" + program + "\"";
  result = run("doctor");
  EXPECT_NE(result.out.find("does not tell its version"), std::string::npos) << result.out;

  environment_ = "PATH=" + folder_.path().string();
  result = run("doctor");
  EXPECT_NE(result.out.find("the program ffmpeg is not in the PATH"), std::string::npos) << result.out;
}

TEST_F(CommandLine, AWordThatIsNoCommandIsNamed) {
  for (const auto& [arguments, text] :
       {std::pair("frobnicate", "\"frobnicate\" is not a command; `maquette --help`"),
        {"scene paint a.maqs", "\"paint\" is not a command; `maquette scene --help`"}}) {
    const Outcome result = run(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
  }
}

TEST_F(CommandLine, ASourceThatIsMissingIsToldBeforeNetworksAreLoaded) {
  environment_ = "MAQ_ONNXRUNTIME_LIB=/no/such.so";
  expect_failure("densepose image:none.jpg --out o", "none.jpg does not exist");
  expect_failure("bench image:none.jpg", "none.jpg does not exist");
  expect_failure("densepose '' --out o", "The source is empty; name a file");
}

TEST_F(CommandLine, WrongUsageIsExitCodeTwoAndHelpTeaches) {
  EXPECT_EQ(run("").exit_code, 2);
  EXPECT_EQ(run("densepose two.png").exit_code, 2) << "--out is required";
  EXPECT_EQ(run("densepose two.png --out o --threshold 2").exit_code, 2);
  EXPECT_EQ(run("densepose two.png --out o --frobnicate").exit_code, 2);
  EXPECT_TRUE(written_files().empty());
  const Outcome help = run("densepose --help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* text : {"_IUV.png", "--overlay", "stub:people", "Examples"}) {
    EXPECT_NE(help.out.find(text), std::string::npos) << text;
  }
}

TEST_F(CommandLine, InfoTellsOfABundleThatIsNotThere) {
  bundle_ = "nowhere";
  const Outcome info = run("info");
  EXPECT_EQ(info.exit_code, 1);
  EXPECT_NE(info.out.find("densepose   missing: nowhere has no manifest.json; see MAQ_BUNDLE"), std::string::npos)
      << info.out;
}

TEST_F(CommandLine, InfoAndSourcesSayWhatThereIs) {
  const Outcome info = run("info");
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE(info.out.find("ONNX Runtime   1."), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("Networks       densepose   " MAQ_TEST_DATA "/tiny_bundle\n"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("heads       " MAQ_TEST_MODELS "/heads-int8\n"), std::string::npos) << info.out;
  const Outcome sources = run("sources");
  for (const char* text : {"image:photo.jpg", "video:clip.mp4", "stub:people"}) {
    EXPECT_NE(sources.out.find(text), std::string::npos) << text;
  }
}

}  // namespace
