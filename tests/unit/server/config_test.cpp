// SPDX-License-Identifier: Apache-2.0
// Configuration: precedence of layers, refused values, and that printed configuration can be read again. Also
// addresses, and the log.
#include "server/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "server/process/listen.h"
#include "server/settings.h"
#include "server/units.h"

namespace warmfront::server {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class ConfigTest : public ::testing::Test {
 protected:
  ~ConfigTest() override { std::filesystem::remove(file_); }

  std::variant<ResolvedConfig, int> resolve(std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "warmfrontd");
    return resolve_config(static_cast<int>(arguments.size()), arguments.data(), environment_, out_, err_);
  }
  void write_file(const std::string& text) { std::ofstream(file_) << text; }

  Environment environment_;
  const std::string file_ =
      std::filesystem::temp_directory_path() / ("warmfront_config_" + std::to_string(getpid()));
  std::ostringstream out_, err_;
};

TEST_F(ConfigTest, FlagsThenEnvironmentThenFileThenDefaults) {
  write_file("max-sessions = 11\nwindow = 12\nthreads = 3\nlisten = [\"127.0.0.1:1\", \"unix:a\"]\n");
  environment_ = {{"WARMFRONT_MAX_SESSIONS", "21"}, {"WARMFRONT_WINDOW", "22"}, {"WARMFRONT_CONFIG", file_}};
  const auto resolved = resolve({"--max-sessions", "31"});
  ASSERT_TRUE(std::holds_alternative<ResolvedConfig>(resolved)) << err_.str();
  const auto& [config, origins, print_only, remarks] = std::get<ResolvedConfig>(resolved);
  EXPECT_TRUE(remarks.empty());
  EXPECT_EQ(config.limits.max_sessions, 31u);
  EXPECT_EQ(config.limits.window, 22u);
  EXPECT_EQ(config.threads, 3);
  EXPECT_EQ(config.listen, (std::vector<std::string>{"127.0.0.1:1", "unix:a"}));
  EXPECT_EQ(config.drain_timeout, Config{}.drain_timeout);
  const std::string text = print_config(std::get<ResolvedConfig>(resolved));
  EXPECT_THAT(text, HasSubstr("(from: flag)\nmax-sessions = \"31\""));
  EXPECT_THAT(text, HasSubstr("(from: environment)\nwindow = \"22\""));
  EXPECT_THAT(text, HasSubstr("(from: file)\nthreads = \"3\""));
  EXPECT_THAT(text, HasSubstr("(from: default)\ndrain-timeout = \"30s\""));
}

TEST_F(ConfigTest, ListsAreCommasOrRepetitionsInFlagsAndVariables) {
  const std::vector<std::string> expected{"unix:a", "unix:b", "127.0.0.1:1"};
  const auto listens = [&](const std::vector<const char*>& flags) {
    const auto resolved = resolve(flags);
    return std::holds_alternative<ResolvedConfig>(resolved) ? std::get<ResolvedConfig>(resolved).config.listen
                                                            : std::vector<std::string>{err_.str()};
  };
  EXPECT_EQ(listens({"--listen", "unix:a,unix:b,127.0.0.1:1"}), expected);
  EXPECT_EQ(listens({"--listen", "unix:a,unix:b", "--listen", "127.0.0.1:1"}), expected);
  environment_ = {{"WARMFRONT_LISTEN", "unix:a,unix:b,127.0.0.1:1"}};
  EXPECT_EQ(listens({}), expected);
}

TEST_F(ConfigTest, WhatIsPrintedReadsBackTheSame) {
  const auto first =
      resolve({"--listen", "unix:x", "--listen", "127.0.0.1:5", "--insecure", "--max-message-bytes", "5MiB",
               "--drain-timeout", "1500ms", "--log-format", "json"});
  ASSERT_TRUE(std::holds_alternative<ResolvedConfig>(first)) << err_.str();
  write_file(print_config(std::get<ResolvedConfig>(first)));
  const auto second = resolve({"--config", file_.c_str()});
  ASSERT_TRUE(std::holds_alternative<ResolvedConfig>(second)) << err_.str();
  for (const Setting& setting : settings())
    EXPECT_EQ(setting.get(std::get<ResolvedConfig>(second).config),
              setting.get(std::get<ResolvedConfig>(first).config))
        << setting.name;
}

TEST_F(ConfigTest, WhatIsPrintedIsInForce) {
  const auto printed =
      resolve({"--print-config", "--max-total-bytes", "1GiB", "--max-session-bytes", "2GiB"});
  ASSERT_TRUE(std::holds_alternative<ResolvedConfig>(printed)) << err_.str();
  const ResolvedConfig& resolved = std::get<ResolvedConfig>(printed);
  EXPECT_THAT(print_config(resolved), HasSubstr("(from: flag)\nmax-session-bytes = \"1GiB\"\n"));
  EXPECT_THAT(resolved.remarks,
              ::testing::Contains(HasSubstr("max-session-bytes is lowered from 2.0 GiB to 1.0 GiB")));
}

TEST_F(ConfigTest, ErrorsAreUsageErrorsThatNameTheirSource) {
  EXPECT_EQ(std::get<int>(resolve({"--window", "0"})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("--window: \"0\": an integer in [1, 64] is expected"));
  EXPECT_EQ(std::get<int>(resolve({"--no-such-flag"})), 3);
  EXPECT_THAT(err_.str(),
              HasSubstr("warmfrontd: there is no option --no-such-flag; see 'warmfrontd --help'\n"));
  EXPECT_EQ(std::get<int>(resolve({"--max-sesions", "3"})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("there is no option --max-sesions; the nearest is --max-sessions; see"));
  EXPECT_EQ(std::get<int>(resolve({"x", "--insecure"})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("the argument 'x' is one too many"));
  environment_ = {{"WARMFRONT_LOG_LEVEL", "loud"}};
  EXPECT_EQ(std::get<int>(resolve({})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("WARMFRONT_LOG_LEVEL: \"loud\""));
  environment_.clear();
  write_file("colour = \"red\"\n");
  EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3);
  EXPECT_THAT(err_.str(), HasSubstr(file_ + ": line 1: colour is no setting; --print-config lists them\n"));
  write_file("log-level = debug\n");
  EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("text is written in quotes, as in log-level = \"debug\""));
  write_file("threads = 1\nthreads = 2\n");
  EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("cannot redefine existing integer 'threads'\n"))
      << "and no advice on quotes";
  write_file("max_sessions = 3\n");
  EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("max_sessions is no setting; it is max-sessions in a file"));
  write_file("window = 0\ncolour = \"red\"\n[limits]\nwindow = 3\n");
  err_.str("");
  EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3);
  EXPECT_THAT(err_.str(),
              MatchesRegex("warmfrontd: .*: line 1: window: .*\nwarmfrontd: .*: line 2: colour is "
                           ".*\nwarmfrontd: .*: line 3: .limits. is a table.*\n"))
      << "all of a file's mistakes, by line";
  EXPECT_EQ(std::get<int>(resolve({"--config", "/nonexistent/file"})), 3);
  EXPECT_EQ(std::get<int>(resolve({"--help"})), 0);
}

TEST_F(ConfigTest, AMistakeInAFileIsShownWithItsLineAndWhatIsNearest) {
  const auto refusal = [&](const char* text) {
    write_file(text);
    err_.str("");
    EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3) << text;
    return err_.str();
  };
  const std::string start = "warmfrontd: " + file_;
  EXPECT_EQ(refusal("threads = 2\n\nmax-session = 3\n"),
            start + ": line 3: max-session is no setting; the nearest is max-sessions\n");
  EXPECT_EQ(refusal("# sizes\nmax_sesions = 3\n"),
            start + ": line 2: max_sesions is no setting; the nearest is max-sessions\n");
  EXPECT_THAT(refusal("threads = 1\nwindow = 0\n"), HasSubstr(start + ": line 2: window: \"0\""));
  for (const char* table :
       {"[server]\nthreads = 1\n", "[[server]]\nthreads = 1\n", "server = {threads = 1}\n"})
    EXPECT_THAT(refusal(table),
                HasSubstr(start + ": line 1: [server] is a table, and tables are not supported: write"));
}

TEST_F(ConfigTest, AFileHasFractionsWithAndWithoutQuotes) {
  for (const char* text : {"trace-sample = 0.5\n", "trace-sample = \"0.5\"\n", "trace-sample = 5e-1\n"}) {
    write_file(text);
    const auto resolved = std::get<ResolvedConfig>(resolve({"--config", file_.c_str()}));
    EXPECT_EQ(resolved.config.trace.sample, 0.5) << text;
  }
  for (const char* text : {"trace-sample = inf\n", "trace-sample = 2020-01-01\n"}) {
    write_file(text);
    err_.str("");
    EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3) << text;
    EXPECT_THAT(err_.str(), HasSubstr("line 1: trace-sample: text, a number, true or false, or a list"));
  }
}

TEST_F(ConfigTest, ADeprecatedNameIsAcceptedWithAWarningButNotBesideTheCurrentOne) {
  for (const char* place : {"flag", "variable", "file"}) {
    environment_.clear();
    std::vector<const char*> flags;
    write_file(place == std::string_view("file") ? "max-streams = 7\n" : "");
    if (place == std::string_view("variable")) environment_ = {{"WARMFRONT_MAX_STREAMS", "7"}};
    if (place == std::string_view("flag")) flags = {"--max-streams", "7"};
    flags.insert(flags.end(), {"--config", file_.c_str()});
    const auto resolved = std::get<ResolvedConfig>(resolve(flags));
    EXPECT_EQ(resolved.config.limits.max_streams_per_connection, 7u) << place;
    ASSERT_EQ(resolved.remarks.size(), 1u) << place;
    EXPECT_THAT(resolved.remarks.front(), HasSubstr(" now; the former one will go"));
    EXPECT_THAT(
        print_config(resolved),
        HasSubstr(" (from: " + std::string(place == std::string_view("variable") ? "environment" : place) +
                  ")\nmax-streams-per-connection = \"7\""));
  }
  environment_.clear();
  EXPECT_EQ(std::get<int>(resolve({"--max-streams", "7", "--max-streams-per-connection", "8"})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("--max-streams: it is the former name of --max-streams-per-connection"));
  EXPECT_EQ(std::get<int>(resolve({"--max-streams", "0"})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("--max-streams: \"0\""));
  EXPECT_EQ(std::get<int>(resolve({"--help"})), 0);
  EXPECT_THAT(out_.str(), ::testing::Not(::testing::ContainsRegex("--max-streams ")));
}

TEST_F(ConfigTest, AVariableCloseToASettingIsAnErrorAndAnUnknownOneAWarning) {
  environment_["WARMFRONT_MAX_SESIONS"] = "3";
  EXPECT_EQ(std::get<int>(resolve({})), 3);
  EXPECT_EQ(err_.str(),
            "warmfrontd: WARMFRONT_MAX_SESIONS is no setting's variable; the nearest is "
            "WARMFRONT_MAX_SESSIONS\n");
  environment_ = {{"WARMFRONT_TOKENFILE", "x"}};
  EXPECT_EQ(std::get<int>(resolve({})), 3);
  EXPECT_THAT(err_.str(), HasSubstr("the nearest is WARMFRONT_TOKEN_FILE"));
  // A Kubernetes service named warmfront, and what our proxy's configuration is told.
  environment_ = {
      {"WARMFRONT_SERVICE_HOST", "10.0.0.1"},     {"WARMFRONT_PORT_50051_TCP", "tcp://10.0.0.1:50051"},
      {"WARMFRONT_METRICS_SERVICE_PORT", "9464"}, {"WARMFRONT_0", "127.0.0.1:50051"},
      {"WARMFRONT_BIND", "127.0.0.1:50050"},      {"WARMFRONT_MAX_SESSIONS", "3"}};
  const auto resolved = std::get<ResolvedConfig>(resolve({}));
  EXPECT_EQ(resolved.config.limits.max_sessions, 3u);
  ASSERT_EQ(resolved.remarks.size(), 1u);
  EXPECT_THAT(resolved.remarks.front(), HasSubstr("WARMFRONT_0, WARMFRONT_BIND, "));
  EXPECT_THAT(resolved.remarks.front(), HasSubstr("ignored"));
}

TEST_F(ConfigTest, OnlyPrefixedProcessVariablesAreRead) {
  const char* const variables[] = {"PATH=/bin", "WARMFRONT_WINDOW=3", "WARMFRONT_LISTEN=a=b",
                                   "WARMFRONT_NONE", nullptr};
  EXPECT_EQ(warmfront_variables(variables),
            (Environment{{"WARMFRONT_WINDOW", "3"}, {"WARMFRONT_LISTEN", "a=b"}}));
}

TEST_F(ConfigTest, AFileThatIsNotTomlIsRefused) {
  // Found by the fuzzer in the reader used before: a list that swallowed the lines after it, a comment sign
  // within quotes, a word that became a switch, a key whose second value won.
  for (const char* bad :
       {"listen = [\"unix:x\"]2\nthreads = 1\n", "reflection\n", "threads = 1\nwindow = 2\nthreads = 3\n",
        "threads = 1.5\n", "[server]\nthreads = 1\n", "listen = [[\"x\"]]\n", "listen = [\"unix:\xff\"]\n",
        "x"}) {
    write_file(bad);
    err_.str("");
    EXPECT_EQ(std::get<int>(resolve({"--config", file_.c_str()})), 3) << bad;
    EXPECT_THAT(err_.str(), HasSubstr(file_)) << bad;
  }
  write_file("listen = [\"unix:#1, \\\"quoted\\\"\"]  # a comment\nthreads = 3\nreflection = true\n");
  const auto resolved = resolve({"--config", file_.c_str()});
  ASSERT_TRUE(std::holds_alternative<ResolvedConfig>(resolved)) << err_.str();
  const Config& config = std::get<ResolvedConfig>(resolved).config;
  EXPECT_EQ(config.listen, (std::vector<std::string>{"unix:#1, \"quoted\""}));
  EXPECT_EQ(config.threads, 3);
  EXPECT_TRUE(config.reflection);
  EXPECT_EQ(std::get<int>(resolve({"--config", "/"})), 3) << "a folder";
  EXPECT_EQ(std::get<int>(resolve({"--listen", "unix:\x01"})), 3) << "what cannot be printed and read again";
}

TEST(UnitsTest, SizesAndTimes) {
  EXPECT_EQ(parse_bytes("64KiB", 1).value(), 65536u);
  EXPECT_EQ(parse_bytes("7", 1).value(), 7u);
  EXPECT_EQ(parse_duration("90s").value(), std::chrono::milliseconds(90'000));
  for (const char* bad : {"", "-1", "1 s", "1x", "99999999999999999999", "18446744073709551615GiB", "0"}) {
    EXPECT_FALSE(parse_bytes(bad, 1).ok()) << bad;
    EXPECT_FALSE(parse_duration(bad).ok()) << bad;
  }
  EXPECT_EQ(format_bytes(3 << 20), "3MiB");
  EXPECT_EQ(format_duration(std::chrono::milliseconds(1500)), "1500ms");
}

TEST(ListenTest, OnlyLoopbackAndSocketsWithoutInsecure) {
  for (const char* local :
       {"127.0.0.1:0", "127.9.9.9:1", "[::1]:50051", "localhost:65535", "unix:/nonexistent/none.sock"}) {
    EXPECT_TRUE(is_local(local)) << local;
    EXPECT_TRUE(check_listen_address(local, false).ok()) << local;
  }
  for (const char* open : {"0.0.0.0:1", "[::]:1", "192.168.0.1:1", "example.org:1", "127.example.org:1"}) {
    EXPECT_EQ(check_listen_address(open, false).error().code, ErrorCode::kInvalidArgument) << open;
    EXPECT_TRUE(check_listen_address(open, true).ok()) << open;
  }
  for (const char* bad : {"", "host", ":1", "host:", "host:65536", "host:1x", "a:b:1", "unix:"})
    EXPECT_EQ(check_listen_address(bad, true).error().code, ErrorCode::kInvalidArgument) << bad;
}

TEST(ListenTest, ReportsTheSystemErrorWhenAnAddressCannotBeBound) {
  EXPECT_THAT(why_not_bound("unix:/nonexistent/none.sock"), HasSubstr("No such file or directory"));
  EXPECT_THAT(why_not_bound("unix:" + ::testing::TempDir()), HasSubstr("no socket"));
  EXPECT_THAT(why_not_bound("192.0.2.1:1"), HasSubstr("Cannot assign requested address"));
  const int taken = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  ASSERT_EQ(bind(taken, reinterpret_cast<const sockaddr*>(&address), length), 0);
  ASSERT_EQ(listen(taken, 1), 0);
  ASSERT_EQ(getsockname(taken, reinterpret_cast<sockaddr*>(&address), &length), 0);
  EXPECT_THAT(why_not_bound("127.0.0.1:" + std::to_string(ntohs(address.sin_port))),
              HasSubstr("Address already in use"));
  close(taken);
  EXPECT_THAT(why_not_bound("127.0.0.1:0"), HasSubstr("listed twice")) << "it can be bound";
}

TEST(LogTest, TextIsOneLineAnEvent) {
  std::ostringstream out;
  Log log(LogLevel::kInfo, LogFormat::kText, &out);
  log.write(LogLevel::kDebug, "hidden");
  log.write(LogLevel::kInfo, "session_created",
            {{"session", "a-b"}, {"bytes", std::uint64_t{7}}, {"why", "two\nlines {}"}});
  EXPECT_THAT(
      out.str(),
      MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9:]{8}\\.[0-9]{3}Z info session_created session=a-b "
                   "bytes=7 why=\"two\\\\nlines \\{\\}\"\n"));
}

TEST(LogTest, JsonLinesParseWhateverTheValues) {
  std::ostringstream out;
  Log log(LogLevel::kInfo, LogFormat::kJson, &out);
  log.write(LogLevel::kWarning, "odd",
            {{"text", "quote \" newline \n %v {} \xff"}, {"yes", true}, {"number", -3.5}});
  const std::string text = out.str();
  const auto line = nlohmann::json::parse(text);
  EXPECT_EQ(line["level"], "warning");
  EXPECT_EQ(line["event"], "odd");
  EXPECT_EQ(line["yes"], true);
  EXPECT_EQ(line["number"], -3.5);
  EXPECT_THAT(line["text"].get<std::string>(), HasSubstr("quote \" newline \n %v {}"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

}  // namespace
}  // namespace warmfront::server
