// The `maquette` program reports lost output, and names of files cannot control the terminal.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "support/program_run.h"

namespace {

namespace fs = std::filesystem;

class CommandLineOutput : public ::testing::Test {
 protected:
  CommandLineOutput() {
    cv::Mat image = cv::Mat::zeros(256, 320, CV_8UC3);
    image(cv::Rect(80, 100, 4, 4)) = cv::Scalar(0, 0, 255);
    cv::imwrite(file("one.png"), image);
  }

  std::string file(const std::string& name) const { return folder_.file(name); }
  Outcome run(const std::string& script) const {
    return run_shell(folder_, "MAQ_BUNDLE='" MAQ_TEST_DATA "/tiny_bundle'", script);
  }
  // The script fails with one sentence with `text`.
  void expect_failure(const std::string& script, const std::string& text) const {
    const Outcome result = run(script);
    EXPECT_EQ(result.exit_code, 1) << script;
    EXPECT_NE(result.err.find(text), std::string::npos) << script << ": " << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  std::set<std::string> unfinished_files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      if (entry.path().filename().string().find(".part") != std::string::npos) names.insert(entry.path().string());
    }
    return names;
  }

  TempFolder folder_;
  const std::string play_ = "maquette play 'stub:pattern?frames=3&fps=10&size=64x48' ";
};

TEST_F(CommandLineOutput, ThatIsLostIsAnError) {
  for (const char* command :
       {"info", "--help", "--version", "sources", "densepose --help", "play 'stub:pattern?frames=2&fps=100'",
        "densepose one.png --out o", "densepose one.png --out o --json", "bench one.png --runs 1 --seconds 0"}) {
    expect_failure(std::string("maquette ") + command + " >/dev/full",
                   "Standard output cannot be written: No space left on device.");
    expect_failure(std::string("maquette ") + command + " >&-", "Standard output cannot be written: Bad file");
  }
  EXPECT_EQ(run("maquette info 2>&-").exit_code, 0);
}

TEST_F(CommandLineOutput, ThatIsLongerThanAFileMayBeIsAnErrorAndNotTheEnd) {
  expect_failure("ulimit -f 1; maquette densepose --help >help.txt",
                 "Standard output cannot be written: File too large.");
}

TEST_F(CommandLineOutput, ThatIsClosedDoesNotGoIntoFiles) {
  run("maquette densepose one.png --out closed >&- 2>&- <&-");
  EXPECT_EQ(run("maquette densepose one.png --out open").exit_code, 0);
  for (const char* name : {"one.json", "one_IUV.png", "one_INDS.png"}) {
    EXPECT_EQ(read_text(file(std::string("closed/") + name)), read_text(file(std::string("open/") + name))) << name;
  }
}

TEST_F(CommandLineOutput, APipeWhoseReaderIsGoneEndsTheRunAndLeavesNothingHalfMade) {
  const Outcome result = run(
      "{ maquette densepose 'stub:people?size=160x120' --out o --overlay --json --max-frames 100000; echo $? >code; } "
      "| head -n 1");
  EXPECT_EQ(read_text(file("code")), "1\n");
  EXPECT_EQ(nlohmann::json::parse(result.out).at("frame"), "stub_people_000000");
  EXPECT_NE(result.err.find("Broken pipe"), std::string::npos) << result.err;
  EXPECT_EQ(unfinished_files(), std::set<std::string>{});
}

TEST_F(CommandLineOutput, ALimitOfFileSizesIsASentenceAndLeavesNothingHalfMade) {
  // In blocks of 512 bytes.
  expect_failure("ulimit -f 2; maquette record 'stub:pattern?frames=3&size=64x48' take.maqrec", "take.maqrec cannot");
  EXPECT_FALSE(fs::exists(file("take.maqrec")));
  expect_failure("ulimit -f 1; maquette densepose one.png --out o", "one_IUV.png cannot be written: File too large");
  EXPECT_TRUE(fs::is_empty(file("o")));
  EXPECT_EQ(
      run("ulimit -f 8; maquette densepose 'stub:people?size=320x256' --out o --overlay --max-frames 9").exit_code, 1);
  EXPECT_EQ(unfinished_files(), std::set<std::string>{});
  EXPECT_EQ(run("maquette record 'stub:pattern?frames=3&size=64x48' take.maqrec").exit_code, 0)
      << "nothing is in the way of the next try";
}

TEST_F(CommandLineOutput, JsonGoesWhereItsNameLeads) {
  const auto frames = [&](const std::string& name) {
    return nlohmann::json::parse(read_text(file(name))).at("frames").get<int>();
  };
  fs::create_directory(file("far"));
  fs::create_symlink("far/figures.json", file("link"));
  ASSERT_EQ(run(play_ + "--json link").exit_code, 0);
  EXPECT_TRUE(fs::is_symlink(file("link")));
  EXPECT_EQ(frames("far/figures.json"), 3);

  const Outcome through_pipe = run("mkfifo pipe; cat pipe >copy & " + play_ + "--json pipe; code=$?; wait; exit $code");
  ASSERT_EQ(through_pipe.exit_code, 0) << through_pipe.err;
  EXPECT_TRUE(fs::is_fifo(file("pipe")));
  EXPECT_EQ(frames("copy"), 3);

  const Outcome to_output = run(play_ + "--json /dev/stdout");
  ASSERT_EQ(to_output.exit_code, 0) << to_output.err;
  EXPECT_EQ(to_output.out.rfind("3 frames of 64 x 48", 0), 0u) << to_output.out;
  EXPECT_EQ(nlohmann::json::parse(to_output.out.substr(to_output.out.find('{'))).at("frames"), 3);

  ASSERT_EQ(run(play_ + "--json /dev/null").exit_code, 0);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  expect_failure(play_ + "--json /dev/full", "/dev/full cannot be written: No space left on device");
}

TEST_F(CommandLineOutput, AListOfCamerasWithLittleMemoryIsNoCrash) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "sanitizers take terabytes of address space";
#endif
  // In KiB. Some are too few for the loader, which says so.
  for (int limit = 40000; limit <= 130000; limit += 6000) {
    const Outcome result = run("ulimit -v " + std::to_string(limit) + "; maquette sources");
    EXPECT_TRUE(result.exit_code <= 1 || result.err.find("error while loading") != std::string::npos)
        << limit << ": " << result.exit_code << " " << result.err;
  }
}

TEST_F(CommandLineOutput, AListOfCamerasWithoutFilesToOpenIsNoCrash) {
  for (const char* files : {"4", "5", "6", "8"}) {
    const Outcome result = run(std::string("ulimit -n ") + files + "; maquette sources");
    // The loader needs more files for the library of a sanitizer than the program does for what it lists.
    if (result.err.find("error while loading shared libraries") != std::string::npos) continue;
    EXPECT_LE(result.exit_code, 1) << files << ": " << result.err;
  }
}

TEST_F(CommandLineOutput, JsonMakesNoFolder) {
  const Outcome result = run(play_ + "--json none/figures.json");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "") << "told before the work";
  EXPECT_NE(result.err.find("none/figures.json cannot be made: No such file"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(file("none")));
}

TEST_F(CommandLineOutput, NamesThatAreNoUtf8AreReplacedInJson) {
  fs::copy(file("one.png"), file("caf\xe9 \xc3\xa4\x1b[31m.png"));
  const Outcome result = run("maquette densepose 'caf\xe9 \xc3\xa4\x1b[31m.png' --out o --json");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("frame"), "caf\xef\xbf\xbd \xc3\xa4\x1b[31m");
  EXPECT_TRUE(std::all_of(result.out.begin(), result.out.end(), [](char c) {
    return c == '\n' || (c >= 32 && c < 127);
  })) << result.out;
  EXPECT_TRUE(fs::exists(file("o/caf\xe9 \xc3\xa4\x1b[31m.json"))) << "files keep the name";
  const Outcome bench = run(
      "maquette bench 'caf\xe9 \xc3\xa4\x1b[31m.png' --runs 1 --seconds 0 --warm-up 0 --json bench.json >/dev/null");
  ASSERT_EQ(bench.exit_code, 0) << bench.err;
  EXPECT_EQ(nlohmann::json::parse(read_text(file("bench.json"))).at("cases")[0].at("source"),
            "file:caf\xef\xbf\xbd \xc3\xa4\x1b[31m.png");
}

TEST_F(CommandLineOutput, ControlCharactersOfNamesAreShownAndNotObeyed) {
  const std::string red = "\x1b[31m", csi = "\xc2\x9b", name = "a" + red + csi + "\xe9\xc3\xa4.png";
  const std::string shown = "a\\x1b[31m\\xc2\\x9b\\xe9\xc3\xa4";
  fs::copy(file("one.png"), file(name));
  const Outcome found = run("maquette densepose '" + name + "' --out o");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_EQ(found.out.rfind(shown + "  320 x 256  1 person", 0), 0u) << found.out;
  const Outcome missing = run("maquette densepose 'none" + name + "' --out o");
  EXPECT_NE(missing.err.find("none" + shown + ".png does not exist"), std::string::npos) << missing.err;
  const Outcome line_end = run("maquette densepose 'none\nmaquette: all is well' --out o");
  EXPECT_EQ(std::count(line_end.err.begin(), line_end.err.end(), '\n'), 1) << line_end.err;
  for (const std::string& command : {"frob" + red, "densepose one.png --out o --frob" + red, "play stub:" + red,
                                     "play 'stub:people?" + red + "=1'", "densepose one.png --out o --size 9" + red,
                                     "record stub:pattern --frames 1 '" + red + "/a'", "info --json" + red}) {
    const Outcome result = run("maquette " + command);
    EXPECT_NE(result.exit_code, 0) << command;
    EXPECT_NE(result.err.find("\\x1b[31m"), std::string::npos) << result.err;
    EXPECT_EQ((result.out + result.err).find('\x1b'), std::string::npos) << result.err;
  }
}

}  // namespace
