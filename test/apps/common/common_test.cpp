// Tests the code that apps share, except optimizers: options, states, stopping, reports and their pages.
#include <gtest/gtest.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/files.h"
#include "common/images.h"
#include "common/options.h"
#include "common/process.h"
#include "common/report.h"
#include "common/run_app.h"
#include "common/state.h"
#include "common/stop.h"
#include "diagnostics/error.h"
#include "support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;

std::string contents_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// The message of the exception that `body` throws.
template <typename Body>
std::string refusal(Body&& body) {
  try {
    body();
  } catch (const retrograde::UserError& error) {
    return error.what();
  }
  return "nothing was refused";
}

void expect_words(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words)
    EXPECT_NE(text.find(word), std::string::npos) << "no \"" << word << "\" in: " << text;
}

apps::CommonOptions parse(std::vector<std::string> words, const apps::CommonDefaults& defaults) {
  apps::CommonOptions options;
  CLI::App cli;
  apps::add_common_options(cli, options, defaults);
  words.insert(words.begin(), "program");
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  EXPECT_TRUE(
      apps::parse_command_line(cli, static_cast<int>(words.size()), pointers.data(), options));
  return options;
}

const apps::CommonDefaults defaults{.needs_input = false, .optimize = {"force", "time"}};

TEST(AppOptions, HaveDefaults) {
  const auto options = parse({"--output", "o"}, defaults);
  EXPECT_EQ(options.steps, 100);
  EXPECT_GE(options.threads, 1);
  EXPECT_TRUE(apps::optimizes(options, "force"));
  EXPECT_TRUE(apps::optimizes(options, "time"));
  EXPECT_FALSE(options.resume || options.explain || options.check_gradients);
  EXPECT_EQ(apps::to_json(options)["optimize"].size(), 2u);
}

TEST(AppOptions, ASubsetIsOptimized) {
  const auto options = parse({"--output", "o", "--optimize", "time"}, defaults);
  EXPECT_FALSE(apps::optimizes(options, "force"));
  EXPECT_TRUE(apps::optimizes(options, "time"));
  EXPECT_TRUE(
      apps::optimizes(parse({"--output", "o", "--optimize", "time,force"}, defaults), "force"));
}

TEST(AppOptions, RefuseWhatTheyDoNotKnowInOneLine) {
  const auto refused = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"--output", "o"});
    const std::string message = refusal([&] { parse(words, defaults); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  };
  expect_words(refused({"--optimize", "luck"}),
               {"no \"luck\" to optimize, but force, time", "--help"});
  expect_words(refused({"--steps", "0"}), {"--steps 0", "must lie between 1 and", "too small"});
  expect_words(refused({"--seconds", "-1"}), {"--seconds", "too small"});
  expect_words(refused({"--seconds", "nan"}), {"--seconds"});
  expect_words(refused({"--threads", "9999"}), {"--threads", "too large"});
  expect_words(refused({"--seed", "blue"}), {"understand the command line", "blue"});
  // An option that this app does not have.
  expect_words(refused({"--memory", "100"}), {"understand the command line", "--memory"});
  expect_words(refusal([] { parse({}, defaults); }), {"--output is required"});
  expect_words(refusal([] { parse({"--output", "o"}, {}); }), {"--input is required"});
}

class AppState : public testing::Test {
 protected:
  AppState() {
    state_.put("x", std::vector<float>{1, 2.5f, -3});
    state_.arrays["empty"] = {};
    state_.put("random", random_);
    apps::write_state(path_, state_);
  }

  std::string refused_after(const std::string& bytes) {
    std::ofstream(path_, std::ios::binary) << bytes;
    return refusal([&] { apps::read_state(path_, "test"); });
  }

  const TemporaryFolder folder_;
  const fs::path path_ = folder_.path() / "state.bin";
  std::mt19937_64 random_{7};
  apps::State state_{.program = "test", .step = 12, .seconds = 3.5};
};

TEST_F(AppState, ComesBackAsItWas) {
  const apps::State back = apps::read_state(path_, "test");
  EXPECT_EQ(back.step, 12);
  EXPECT_EQ(back.seconds, 3.5);
  EXPECT_EQ(back.arrays, state_.arrays);
  std::vector<float> x(3);
  back.get("x", x);
  EXPECT_EQ(x, (std::vector<float>{1, 2.5f, -3}));
  std::mt19937_64 random;
  back.get("random", random);
  EXPECT_EQ(random(), random_());
}

TEST_F(AppState, EveryCutIsNoticed) {
  const std::string whole = contents_of(path_);
  for (size_t length = 0; length < whole.size(); length += 7)
    expect_words(refused_after(whole.substr(0, length)), {"whole state of an earlier run"});
  expect_words(refused_after(whole + "x"), {"truncated or has a tail"});
}

TEST_F(AppState, EveryFlippedBitIsNoticed) {
  const std::string whole = contents_of(path_);
  for (size_t at = 0; at < whole.size(); at += 3) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 16);
    expect_words(refused_after(damaged), {"resume from", "state.bin", "--resume"});
  }
}

TEST_F(AppState, OtherFilesAreNoStates) {
  expect_words(refused_after("a text about something else, long enough to have a head"),
               {"does not begin as a state does"});
  expect_words(refusal([&] { apps::read_state(path_.parent_path() / "none", "test"); }),
               {"no such file can be read"});
  apps::write_state(path_, state_);
  expect_words(refusal([&] { apps::read_state(path_, "another"); }), {"it is one of \"test\""});
}

TEST_F(AppState, ItsArraysMustFit) {
  expect_words(refusal([&] { (void)state_.array("x", 4); }), {"\"x\" of 4 numbers", "it has 3"});
  expect_words(refusal([&] { (void)state_.array("y", 4); }), {"\"y\"", "it has none"});
  std::mt19937_64 random;
  expect_words(refusal([&] { state_.get("other", random); }), {"random numbers \"other\""});
}

TEST(AppStop, ASignalSetsTheFlag) {
  apps::catch_stop_signals();
  EXPECT_FALSE(apps::stop_requested());
  ::raise(SIGTERM);
  EXPECT_TRUE(apps::stop_requested());
  apps::request_stop(false);
}

// timeout(1) sends the signal twice: to a program and to the program's group.
TEST(AppStop, ASignalSentTwiceAtOnceIsOne) {
  apps::catch_stop_signals();
  ::raise(SIGINT);
  ::raise(SIGINT);
  EXPECT_TRUE(apps::stop_requested());
  apps::request_stop(false);
}

TEST(AppStopDeathTest, TheSecondSignalEnds) {
  EXPECT_EXIT(
      {
        apps::catch_stop_signals();
        ::raise(SIGINT);
        std::this_thread::sleep_for(std::chrono::milliseconds(250));
        ::raise(SIGINT);
      },
      testing::KilledBySignal(SIGINT), "");
}

TEST(AppRun, ErrorsBecomeOneLineAndAStatus) {
  testing::internal::CaptureStderr();
  const auto throws = [](auto error) {
    return apps::run_app("app", 0, nullptr, [&](int, char**) { throw error; });
  };
  EXPECT_EQ(throws(retrograde::UserError(retrograde::Message{"do it", "a\nb", "c", "D"})), 1);
  EXPECT_EQ(throws(std::bad_alloc()), 1);
  EXPECT_EQ(throws(std::runtime_error("odd\n")), 1);
  EXPECT_EQ(apps::run_app("app", 0, nullptr, [](int, char**) {}), 0);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 3) << said;
  expect_words(said, {"app: cannot do it: a b; c. D.\n", "app: cannot go on", "app: odd\n"});
}

class AppReport : public testing::Test {
 protected:
  // Writes a report with two pictures, a plot of two series, and a table.
  void write_report(const std::string& name, bool all_pictures = true) {
    apps::CommonOptions options;
    options.output = folder_.path() / name;
    fs::create_directories(options.output);
    apps::Report report(name, options);
    report.add_number("PSNR", 31.25, "dB", 20.5, "at least 30");
    report.add_number("lost", NAN);
    report.add_picture("before.png", "before <it>");
    report.add_picture("after.png", "after");
    report.add_plot(
        {.title = "loss",
         .log_y = true,
         .series = {{"one", {0, 1, 2}, {1, 0.1, 0.01}}, {"points", {1, 2}, {NAN, 3}, {"a", "b"}}}});
    report.add_table({"speeds", {"what", "ms"}, {{"ours", 1.5}, {"theirs", nullptr}}});
    report.own["extra"] = 5;
    write_picture(options.output / "before.png", 8);
    if (all_pictures) write_picture(options.output / "after.png", 16);
    report.write(7, true);
  }

  static void write_picture(const fs::path& path, int bits) {
    apps::Image image{1400, 60, bits, {}};  // wider than the page
    for (long n = 0; n < image.elems(); ++n)
      image.pixels.push_back(static_cast<float>(n % 311) / 311);
    apps::write_image(path, image);
  }

  static std::string script() {
    return (apps::program_folder() / ".." / "share" / "retrograde" / "make_index.py").string();
  }
  apps::Outcome make_index() {
    return apps::run_program({"/usr/bin/python3", script(), folder_.path()});
  }

  apps::Outcome browse(std::vector<std::string> more) {
    std::vector<std::string> command{"chromium",
                                     "--headless",
                                     "--no-sandbox",
                                     "--disable-gpu",
                                     "--hide-scrollbars",
                                     "--user-data-dir=" + (folder_.path() / "profile").string(),
                                     "--virtual-time-budget=5000"};
    command.insert(command.end(), more.begin(), more.end());
    return apps::run_program(command);
  }

  const TemporaryFolder folder_;
};

TEST_F(AppReport, HasACommonHeadAndAPlot) {
  write_report("one");
  const auto report = nlohmann::json::parse(contents_of(folder_.path() / "one" / "report.json"));
  EXPECT_EQ(report["program"], "one");
  EXPECT_EQ(report["steps"], 7);
  EXPECT_EQ(report["stopped"], true);
  EXPECT_GT(report["peak_memory_mb"], 0);
  EXPECT_EQ(report["one"]["extra"], 5);
  EXPECT_TRUE(report["numbers"][1]["value"].is_null());
  EXPECT_TRUE(report["plots"][0]["series"][1]["y"][0].is_null());
  const apps::Image plot = apps::read_image(folder_.path() / "one" / "error_vs_time.png");
  EXPECT_EQ(plot.width, 960);
  EXPECT_EQ(plot.height, 600);
}

TEST_F(AppReport, APlotWithoutPointsIsDrawnToo) {
  apps::CommonOptions options;
  options.output = folder_.path();
  apps::Report report("none", options);
  report.add_plot(
      {.title = "nothing", .log_x = true, .log_y = true, .series = {{"empty", {}, {}}}});
  report.write(0, false);
  EXPECT_EQ(apps::read_image(folder_.path() / "error_vs_time.png").width, 960);
}

TEST_F(AppReport, TablesBecomeMarkdown) {
  const apps::Table table{"t", {"a", "b"}, {{"x", 0.00012345}, {3, nullptr}}};
  EXPECT_EQ(table.to_markdown(), "| a | b |\n|---|---|\n| x | 0.0001234 |\n| 3 | - |\n");
}

TEST_F(AppReport, AFolderWithoutReportsHasNoPage) {
  const auto outcome = make_index();
  EXPECT_EQ(outcome.status, 1);
  expect_words(outcome.output, {"cannot write", "there is none"});
  EXPECT_FALSE(fs::exists(folder_.path() / "index.html"));
}

TEST_F(AppReport, AMissingPictureIsNamed) {
  write_report("one", false);
  EXPECT_EQ(make_index().status, 0);
  expect_words(contents_of(folder_.path() / "index.html"), {"after.png is missing"});
}

// A browser shows the page completely: it loads nothing from elsewhere, and every picture is valid.
TEST_F(AppReport, ThePageShowsEverythingInABrowser) {
  write_report("one");
  write_report("two");
  const auto outcome = make_index();
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  std::string page = contents_of(folder_.path() / "index.html");
  expect_words(page,
               {"before &lt;it&gt;", "<td class=\"number\">31.25</td>", "at least 30", "speeds"});
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  // The page lies alone in a folder, so that it can only show files of that folder; the test notes the sizes of its
  // pictures.
  const fs::path alone = folder_.path() / "alone";
  fs::create_directories(alone);
  const std::string note =
      "<script>addEventListener('load', () => { for (const i of document.images) "
      "i.dataset.size = i.naturalWidth + 'x' + i.naturalHeight; });</script></body>";
  page.replace(page.find("</body>"), 7, note);
  std::ofstream(alone / "page.html") << page;
  const std::string address = "file://" + (alone / "page.html").string();

  const auto dom = browse({"--dump-dom", address});
  ASSERT_TRUE(dom.started) << "chromium is in tools/packages.list";
  size_t pictures = 0;
  for (size_t at = 0; (at = dom.output.find("data-size=\"", at)) != std::string::npos; ++pictures)
    EXPECT_NE(dom.output[at += 11], '0') << "a picture did not load";
  EXPECT_EQ(pictures, 6u) << dom.output.substr(0, 400);

  const fs::path shot = alone / "shot.png";
  browse({"--window-size=1200,1600", "--screenshot=" + shot.string(), address});
  const apps::Image image = apps::read_image(shot);
  EXPECT_EQ(image.width, 1200);
  EXPECT_EQ(image.height, 1600);
  const auto dark =
      std::count_if(image.pixels.begin(), image.pixels.end(), [](float v) { return v < 0.9f; });
  EXPECT_GT(dark, image.elems() / 50) << "the page is blank";
  EXPECT_LT(dark, image.elems() * 9 / 10);
}

}  // namespace
