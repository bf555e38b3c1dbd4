// SPDX-License-Identifier: Apache-2.0
// The file format: any written combination of parts is read back; everything else is refused with the byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "client/cli/recording/recorded_session.h"
#include "proto/recording/reader.h"
#include "proto/recording/writer.h"
#include "tests/unit/client/temporary_folder.h"

namespace warmfront::client {
namespace {

using recording::Reader;
using recording::Writer;
using ::testing::HasSubstr;

v1::RecordedMessage answer(std::uint64_t frame) {
  v1::RecordedMessage message;
  message.mutable_answer()->set_frame(frame);
  message.mutable_answer()->mutable_outcome()->set_message(std::string(frame * 40, 'x'));
  return message;
}

/// A file with this many answers.
std::string write_answers(const TemporaryFolder& folder, std::uint64_t count) {
  const std::string path = folder.file("r.wfrec");
  {
    auto writer = Writer::create(path, "test 1.2.3").value();
    for (std::uint64_t i = 1; i <= count; ++i) writer->write(answer(i));
  }
  return path;
}

struct Records {
  std::uint64_t answers = 0;
  bool ended = false;
  std::uint64_t torn_bytes = 0;
  std::string error;
};
Records read_all(const std::string& path) {
  Records records;
  Result<Reader> reader = Reader::open(path);
  if (!reader) {
    records.error = reader.error().message;
    return records;
  }
  for (;;) {
    auto record = reader.value().next();
    if (!record) {
      records.error = record.error().message;
      return records;
    }
    if (!record.value()) break;
    if (record.value()->has_answer()) {
      EXPECT_EQ(record.value()->answer().frame(), ++records.answers);
    }
    records.ended |= record.value()->has_end();
  }
  records.torn_bytes = reader.value().torn_bytes();
  return records;
}

TEST(RecordingFormat, IsReadAsItWasWrittenAndIsTheOwnersAlone) {
  const TemporaryFolder folder;
  const std::string path = write_answers(folder, 5);
  const Records records = read_all(path);
  EXPECT_EQ(records.answers, 5u) << records.error;
  EXPECT_TRUE(records.ended);
  EXPECT_EQ(Reader::open(path).value().header().writer(), "test 1.2.3");
  struct stat status {};
  ASSERT_EQ(stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  EXPECT_FALSE(Writer::create(path, "test").ok()) << "nothing is overwritten";
}

TEST(RecordingFormat, ATruncatedTailIsDroppedAndReported) {
  const TemporaryFolder folder;
  const std::string whole = folder.read(write_answers(folder, 4).substr(folder.path().size() + 1));
  std::uint64_t most = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Records records = read_all(folder.write("torn.wfrec", whole.substr(0, size)));
    EXPECT_FALSE(records.ended);
    if (records.error.empty()) {
      EXPECT_GE(records.answers, most) << "a longer file has at least as many records";
      most = records.answers;
      EXPECT_LT(records.torn_bytes, 300u);
    } else {
      EXPECT_LT(size, 80u) << "only what lacks a header is no recording: " << records.error;
    }
  }
  EXPECT_EQ(most, 4u);
}

TEST(RecordingFormat, WhatIsNoRecordingIsRefusedWithTheByte) {
  const TemporaryFolder folder;
  const std::string whole = folder.read(write_answers(folder, 2).substr(folder.path().size() + 1));
  const auto error_of = [&](const std::string& bytes) {
    return read_all(folder.write("bad.wfrec", bytes)).error;
  };
  EXPECT_THAT(error_of(""), HasSubstr("byte 0: not a recording"));
  EXPECT_THAT(error_of("WFREC\n\x1a" + whole.substr(8)), HasSubstr("not a recording"))
      << "line ends were changed";
  EXPECT_THAT(error_of(whole.substr(0, 8) + std::string(6, '\xff')), HasSubstr("byte 8: no record's length"));
  EXPECT_THAT(error_of(whole.substr(0, 8) + "\xff\xff\xff\xff\x0f"),
              HasSubstr("byte 8: a record of 4294967295 bytes"));
  EXPECT_THAT(error_of(whole + whole.substr(8)), HasSubstr("goes on behind its end"));
  EXPECT_THAT(error_of(whole.substr(0, 8) + std::string("\x02\x08\x01", 3)), HasSubstr("byte 8"));
  v1::RecordedMessage header;
  header.mutable_header()->set_version(2);
  const std::string bytes = header.SerializeAsString();
  EXPECT_THAT(error_of(whole.substr(0, 8) + static_cast<char>(bytes.size()) + bytes), HasSubstr("version 2"));
  EXPECT_THAT(read_all(folder.path()).error, HasSubstr("not a file"));
  EXPECT_THAT(read_all(folder.file("none")).error, HasSubstr("cannot read"));
}

RC_GTEST_PROP(RecordingFormat, DamagedBytesNeverPassForAnotherFormOrReadBeyond, ()) {
  const TemporaryFolder folder;
  std::string bytes = folder.read(write_answers(folder, 4).substr(folder.path().size() + 1));
  for (int i = *rc::gen::inRange(1, 6); i > 0; --i)
    bytes[*rc::gen::inRange<std::size_t>(0, bytes.size())] = static_cast<char>(*rc::gen::inRange(0, 256));
  const std::string path = folder.write("damaged.wfrec", bytes);
  Result<RecordedSession> session = RecordedSession::open(path);
  RC_ASSERT(!session);  // there is no upload in it, whatever was changed
  RC_ASSERT(session.error().message.starts_with(path + ": byte "));
}

TEST(RecordingFormat, StopsAtItsBoundWithAMarker) {
  const TemporaryFolder folder;
  const std::string path = folder.file("bounded.wfrec");
  std::size_t left = 400;
  std::string told;
  {
    auto writer = Writer::create(path, "test",
                                 {.admit = [&](std::size_t n) { return n <= left && (left -= n, true); },
                                  .stopped = [&](const std::string& reason) { told += reason; }})
                      .value();
    for (std::uint64_t i = 1; i <= 9; ++i) writer->write(answer(i));
    EXPECT_EQ(writer->stop_reason(), told);
  }
  EXPECT_THAT(told, HasSubstr("bound"));
  const Records records = read_all(path);
  EXPECT_EQ(records.answers, 3u) << "40 + 80 + 120 bytes, and their records' own, fit into 400";
  EXPECT_TRUE(records.ended);
}

TEST(RecordingFormat, AFullDiskStopsItBehindTheLastWholeRecord) {
  const TemporaryFolder folder;
  const std::string path = folder.file("full.wfrec");
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  {
    auto writer = Writer::create(path, "test").value();
    rlimit small = before;
    small.rlim_cur = 600;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    for (std::uint64_t i = 1; i <= 9; ++i) writer->write(answer(i));
    EXPECT_FALSE(writer->stop_reason().empty());
  }
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  const Records records = read_all(path);
  EXPECT_EQ(records.error, "");
  EXPECT_GE(records.answers, 3u);
  EXPECT_EQ(records.torn_bytes, 0u) << "the part of a record that was written is taken back";
}

}  // namespace
}  // namespace warmfront::client
