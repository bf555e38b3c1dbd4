// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 1 to 7: bad, degenerate and extreme scenes and positions.
#include "tests/faults/fault_table.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

std::string bytes_of_faces(const std::vector<std::array<std::int32_t, 3>>& faces) {
  return {reinterpret_cast<const char*>(faces.data()), faces.size() * 12};
}

v1::SessionHeader header_for(std::uint32_t vertices, std::size_t faces, const std::string& id = kId) {
  v1::SessionHeader header;
  header.set_session_id(id);
  header.set_vertex_count(vertices);
  header.set_face_count(static_cast<std::uint32_t>(faces));
  header.set_dtype(v1::DTYPE_FLOAT64);
  return header;
}

TEST_F(FaultTable, Row01_NotANumberOrInfiniteVertex) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    std::vector<double> positions = grids_.positions(0);
    positions[3 * 17 + 1] = bad;
    expect_fault(create(header(), faces(), bytes_of(positions)), StatusCode::INVALID_ARGUMENT,
                 v1::ERROR_REASON_INVALID_INPUT, "17");
  }
  ASSERT_TRUE(create().ok());
  std::vector<double> positions = grids_.positions(1);
  positions[3 * 5] = std::numeric_limits<double>::quiet_NaN();
  positions[3 * 9] = std::numeric_limits<double>::infinity();
  expect_fault(step(1, bytes_of(positions)), StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID_INPUT,
               "5");
  // Denormals are numbers, and what was refused did not count.
  std::vector<double> denormal = grids_.positions(1);
  for (std::size_t i = 0; i < denormal.size(); i += 7) denormal[i] = 5e-324 * static_cast<double>(i % 5);
  EXPECT_TRUE(step(1, bytes_of(denormal)).ok());
}

TEST_F(FaultTable, Row02_FaceIndexOutOfRange) {
  const auto vertices = static_cast<std::int32_t>(grids_.vertex_count());
  for (const std::int32_t bad :
       {vertices, -1, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()}) {
    auto faces = grids_.scene().faces;
    faces[5][1] = bad;
    expect_fault(create(header(), bytes_of_faces(faces), frame(0)), StatusCode::INVALID_ARGUMENT,
                 v1::ERROR_REASON_INVALID_INPUT, "5");
  }
}

TEST_F(FaultTable, Row03_WrongLengthUnknownDtypeAndSizesThatOverflow) {
  begin({"--max-vertices", "4294967295", "--max-triangles", "4294967295"});
  const auto refused = [&](const v1::SessionHeader& header, const std::string& faces,
                           const std::string& positions) {
    const grpc::Status status = create(header, faces, positions);
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << status.error_message();
  };
  refused(header(), faces().substr(1), frame(0));
  refused(header(), faces() + "x", frame(0));
  refused(header(), faces(), frame(0).substr(8));
  refused(header(), faces(), frame(0) + std::string(8, 'x'));
  v1::SessionHeader odd = header();
  for (const int dtype : {0, 99}) {
    odd.set_dtype(static_cast<v1::Dtype>(dtype));
    refused(odd, faces(), frame(0));
  }
  // 3 n sizeof(double) is 96 GiB here, and beyond 32 bits: refused for its size or for what is missing, and
  // nothing is set aside for what was only announced.
  for (const auto& announced : {header_for(4294967295U, 1), header_for(4, 4294967295U)}) {
    const StatusCode code = create(announced, faces().substr(0, 12), frame(0)).error_code();
    EXPECT_TRUE(code == StatusCode::RESOURCE_EXHAUSTED || code == StatusCode::INVALID_ARGUMENT) << code;
  }
  ASSERT_TRUE(create().ok());
  for (const std::string& wrong : {frame(1).substr(1), frame(1) + "x", std::string()})
    EXPECT_EQ(step(1, wrong).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(FaultTable, Row04_DegenerateScenesAreTaken) {
  const auto takes = [&](const char* what, const std::vector<std::array<std::int32_t, 3>>& faces,
                         const std::vector<double>& positions) {
    const auto vertices = static_cast<std::uint32_t>(positions.size() / 3);
    const grpc::Status created =
        create(header_for(vertices, faces.size(), kOther), bytes_of_faces(faces), bytes_of(positions));
    ASSERT_TRUE(created.ok()) << what << ": " << created.error_message();
    std::vector<double> moved = positions;
    for (std::size_t i = 2; i < moved.size(); i += 3) moved[i] -= 1;
    EXPECT_TRUE(step(1, bytes_of(moved), nullptr, kOther).ok()) << what;
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(kOther);
    v1::DeleteSessionResponse deleted;
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &deleted).ok());
  };
  takes("faces without area", {{0, 1, 2}, {0, 1, 3}}, {0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 0, 0});
  takes("faces that repeat a vertex", {{0, 0, 1}, {2, 3, 2}, {1, 1, 1}, {1, 2, 3}},
        {0, 0, 0, 1, 0, 0, 2, 0, 1, 1, 0, 1});
  takes("vertices in one place", {{0, 1, 2}, {3, 4, 5}},
        {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0});
  takes("an edge of four faces", {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}, {0, 1, 5}},
        {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1});
  takes("the same face twice", {{0, 1, 2}, {0, 1, 2}, {2, 1, 0}}, {0, 0, 0, 1, 0, 0, 0, 1, 0});
  takes("vertices of no face", {{0, 1, 2}}, {0, 0, 0, 1, 0, 0, 0, 1, 0, 9, 9, 9});
  takes("nothing", {}, {});
  takes("points alone", {}, {0, 0, 0, 1, 1, 1});
}

TEST_F(FaultTable, Row05_HugeCoordinatesAndAMeshInOnePoint) {
  const std::size_t numbers = std::size_t{3} * grids_.vertex_count();
  for (const double size : {1e30, 1e150, 1e300, std::numeric_limits<double>::max(), 5e-324, 0.0}) {
    std::vector<double> start = grids_.positions(0), next = grids_.positions(1);
    for (std::size_t i = 0; i < numbers; ++i) {
      start[i] *= size / 8;
      next[i] *= size / 8;
    }
    // Either is right; a hang or a crash is not, and calls end within their deadline.
    const grpc::Status created = create(header(kOther), faces(), bytes_of(start));
    EXPECT_TRUE(created.ok() || created.error_code() == StatusCode::INVALID_ARGUMENT)
        << size << ": " << created.error_message();
    if (!created.ok()) continue;
    const grpc::Status stepped = step(1, bytes_of(next), nullptr, kOther);
    EXPECT_TRUE(stepped.ok() || stepped.error_code() == StatusCode::INVALID_ARGUMENT)
        << size << ": " << stepped.error_message();
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(kOther);
    v1::DeleteSessionResponse deleted;
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &deleted).ok());
  }
}

TEST_F(FaultTable, Row06_EverythingOverlaps) {
  begin({"--max-contacts", "5000"});
  constexpr int kTriangles = 60;
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<double> apart, together;
  for (int i = 0; i < kTriangles; ++i) {
    faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    for (int corner = 0; corner < 3; ++corner) {
      const double x = corner == 1 ? 1.0 : 0.0, y = corner == 2 ? 1.0 : 0.0;
      apart.insert(apart.end(), {x, y, 10.0 * i});
      together.insert(together.end(), {x, y, -1e-3 * i});  // each through all before it
    }
  }
  ASSERT_TRUE(create(header_for(3 * kTriangles, faces.size()), bytes_of_faces(faces), bytes_of(apart)).ok());
  expect_fault(step(1, bytes_of(together)), StatusCode::RESOURCE_EXHAUSTED, v1::ERROR_REASON_LIMIT, "5000");
  // The session is where it was: the same frame with positions that stay apart is answered.
  std::vector<double> still = apart;
  for (std::size_t i = 2; i < still.size(); i += 3) still[i] += 1;
  v1::StepResponse response;
  ASSERT_TRUE(step(1, bytes_of(still), &response).ok());
  EXPECT_EQ(response.summary().rows(), 0U);
  // A question for the count alone is answered.
  v1::SessionHeader counting = header_for(3 * kTriangles, faces.size(), kOther);
  counting.mutable_options()->set_report(v1::REPORT_COUNT);
  ASSERT_TRUE(create(counting, bytes_of_faces(faces), bytes_of(apart)).ok());
  const grpc::Status counted = step(1, bytes_of(together), &response, kOther);
  ASSERT_TRUE(counted.ok()) << counted.error_message();
  EXPECT_GT(response.summary().vf() + response.summary().ee(), 5000U);
}

TEST_F(FaultTable, Row07_WrongVertexCountForTheSession) {
  ASSERT_TRUE(create().ok());
  const std::string more = bytes_of(MovingGrids(7).positions(1)),
                    fewer = bytes_of(MovingGrids(5).positions(1));
  expect_fault(step(1, more), StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID_INPUT, "expected");
  expect_fault(step(1, fewer), StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID_INPUT, "expected");
  Context context;
  const auto stream = open(context, 1);
  v1::StreamStepsResponse response;
  for (const std::string& wrong : {more, fewer}) {
    ASSERT_TRUE(stream->Write(frame_message(1, wrong)) && stream->Read(&response));
    EXPECT_EQ(response.error().status().code(), StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(response.error().frame(), 1U);
  }
  ASSERT_TRUE(stream->Write(frame_message(1, frame(1))) && stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), local_hashes(grids_, 0, 1).front());
}

}  // namespace
}  // namespace warmfront::test
