// Bad input on every call of TrajectoryService. The calls and their fields are read off the service's descriptor, so a call or a
// field that nobody has written rows for fails here: every number is tried as not a number, infinite and huge, every text as empty,
// not UTF-8 and too large, every name as unknown. Each is refused with its code, its reason and the value or field it is about.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/generic/generic_stub.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "tests/rpc/trajectory_service_fixture.hpp"

namespace lambdajet::trajectory {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using google::protobuf::Reflection;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr int kTooMany = 1001;
constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
constexpr const char* kEmptyDrawing = "0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n";

// One bad value for one field.
struct Row {
  std::string name;
  std::function<void(Message&, const FieldDescriptor&)> spoil;
  absl::StatusCode code = kInvalid;
  std::string reason;
  std::string says;  // stands in the message or in a violation
};

// Where any value of the field's type means something, and what it means.
const std::set<std::string>& AnyValueIsRight() {
  static const std::set<std::string> fields = {
      "PlanOptions.compensate",   // yes or no
      "ToleranceWish.last_line",  // a line beyond the last is the last
      "ToleranceWish.contour",    // a contour that is not there has no wish
      "ToolpathSettings.keep_drawing_order",
      "StopStreamingRequest.plan_id",  // what is not streamed is stopped already
  };
  return fields;
}

template <typename Value>
Row Set(std::string name, void (Reflection::*set)(Message*, const FieldDescriptor*, Value) const, Value value,
        std::string reason, std::string says, absl::StatusCode code = kInvalid) {
  return {std::move(name),
          [set, value](Message& m, const FieldDescriptor& f) { (m.GetReflection()->*set)(&m, &f, value); },
          code, std::move(reason), std::move(says)};
}

Row SetText(std::string name, std::string text, std::string reason, std::string says) {
  return {std::move(name),
          [text = std::move(text)](Message& m, const FieldDescriptor& f) {
            m.GetReflection()->SetString(&m, &f, text);
          },
          kInvalid, std::move(reason), std::move(says)};
}

std::vector<Row> RowsOfDouble(const std::string& path) {
  std::vector<Row> rows;
  for (const double bad : {kNotANumber, kEndless, -kEndless, 1e300, -1e300}) {
    rows.push_back(Set<double>(std::to_string(bad), &Reflection::SetDouble, bad,
                               std::isfinite(bad) ? "OUT_OF_RANGE" : "NOT_FINITE", path));
  }
  return rows;
}

std::vector<Row> RowsOfProgram() {
  return {SetText("empty", "", "EMPTY", "program"),
          SetText("not UTF-8", "G21\n(\xC3\x28)\n", "NOT_UTF8", "program"),
          SetText("NUL", std::string("G21\0G90", 7), "NOT_UTF8", "program"),
          SetText("too large", std::string((64u << 20) + 1, 'G'), "PROGRAM_TOO_LARGE", "67108865")};
}

Row RowOfMany(const std::string& path) {
  return {"too many",
          [](Message& m, const FieldDescriptor& f) {
            for (int i = 0; i < kTooMany; ++i) {
              if (f.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
                m.GetReflection()->AddMessage(&m, &f);
              } else if (f.cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
                m.GetReflection()->AddString(&m, &f, "L");
              } else {
                m.GetReflection()->AddUInt32(&m, &f, 1);
              }
            }
          },
          kInvalid, "TOO_MANY", path};
}

std::vector<Row> PlanRows() {
  return {Set<std::uint64_t>("unknown", &Reflection::SetUInt64, 7u, "UNKNOWN_PLAN", "plan 7",
                             absl::StatusCode::kNotFound)};
}

Row Unknown(const char* reason) { return Set<int>("unknown", &Reflection::SetEnumValue, 99, reason, ""); }

// Rows of fields that are neither doubles nor lists, by message and field.
std::map<std::string, std::vector<Row>> NamedRows() {
  std::map<std::string, std::vector<Row>> rows;
  for (const char* message : {"AdmitProgramRequest", "PlanProgramRequest", "ListOperationsRequest"}) {
    rows[std::string(message) + ".program"] = RowsOfProgram();
    rows[std::string(message) + ".format"] = {Unknown("UNKNOWN_FORMAT")};
  }
  rows["ExportRequest.program"] = RowsOfProgram();
  rows["ExportRequest.program_format"] = rows["ExportRequest.format"] = {Unknown("UNKNOWN_FORMAT")};
  for (const char* message : {"GetPlanRequest", "WatchPlanRequest", "CancelPlanRequest",
                              "StreamSamplesRequest", "StartStreamingRequest", "ExportRequest"}) {
    rows[std::string(message) + ".plan_id"] = PlanRows();
  }
  for (const int size : {-1, 101, std::numeric_limits<int>::min()}) {
    rows["ListPlansRequest.page_size"].push_back(
        Set<std::int32_t>(std::to_string(size), &Reflection::SetInt32, size, "OUT_OF_RANGE", "page_size"));
  }
  rows["ListPlansRequest.page_token"] = {
      SetText("no number", "x1", "BAD_TOKEN", "page_token"),
      SetText("beyond 64 bits", "99999999999999999999999", "BAD_TOKEN", "page_token"),
      SetText("huge", std::string(1u << 20, '1'), "BAD_TOKEN", "page_token"),
      SetText("not UTF-8", "\xC3\x28", "BAD_TOKEN", "page_token")};
  rows["PlanOptions.machine_version"] = {Set<std::uint32_t>("not held", &Reflection::SetUInt32, 17u,
                                                            "MACHINE_VERSION_NOT_HELD", "version 17",
                                                            absl::StatusCode::kFailedPrecondition)};
  rows["ToleranceWish.first_line"] = {
      Set<std::uint32_t>("beyond the last", &Reflection::SetUInt32, 9u, "LINES_REVERSED", "last_line")};
  rows["ToolpathSettings.tab_count"] = {
      Set<std::uint32_t>("1001", &Reflection::SetUInt32, 1001u, "OUT_OF_RANGE", "tab_count")};
  for (const char* message : {"PlanOptions", "ListOperationsRequest", "ExportRequest"}) {
    rows[std::string(message) + ".mechanism"] = {
        Set<int>("unknown", &Reflection::SetEnumValue, 99, "UNKNOWN_MECHANISM", "99"),
        Set<int>("the hexapod, where there is none", &Reflection::SetEnumValue, 2, "NO_HEXAPOD", "hexapod",
                 absl::StatusCode::kFailedPrecondition)};
  }
  rows["ToolpathSettings.lead"] = {Unknown("UNKNOWN_LEAD")};
  rows["ToolpathSettings.pierce"] = {Unknown("UNKNOWN_PIERCE")};
  return rows;
}

// A field of a request, and how to come to it.
struct Place {
  std::vector<const FieldDescriptor*> chain;  // the last is the field
  std::string path;

  const FieldDescriptor& field() const { return *chain.back(); }
  std::string name() const { return field().containing_type()->name() + "." + field().name(); }
  // The message that has the field; lists on the way get one element.
  Message& Holder(Message& request) const {
    Message* at = &request;
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      const Reflection& reflection = *at->GetReflection();
      at = chain[i]->is_repeated() ? reflection.AddMessage(at, chain[i])
                                   : reflection.MutableMessage(at, chain[i]);
    }
    return *at;
  }
};

void AddPlaces(const Descriptor& message, const Place& above, std::vector<Place>& places) {
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    Place place = above;
    place.chain.push_back(&field);
    place.path += (place.path.empty() ? "" : ".") + field.name();
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE || field.is_repeated()) {
      places.push_back(place);
    }
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      place.path += field.is_repeated() ? "[0]" : "";
      AddPlaces(*field.message_type(), place, places);
    }
  }
}

class TrajectoryBadInput : public TrajectoryServiceTest {
 protected:
  TrajectoryBadInput() { plan_id_ = PlanAndWait(kPlate).summary().plan_id(); }

  // Any call, streamed or not, with any bytes.
  absl::Status CallWith(const MethodDescriptor& method, const std::string& bytes, double deadline_s = 60.0) {
    grpc::GenericStub stub(channel_);
    grpc::CompletionQueue queue;
    grpc::ClientContext context;
    SetDeadline(context, deadline_s);
    const std::string path = "/" + method.service()->full_name() + "/" + method.name();
    const auto call = stub.PrepareCall(&context, path, &queue);
    const auto done = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    call->StartCall(nullptr);
    if (done()) {
      const grpc::Slice slice(bytes);
      call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
      done();
      grpc::ByteBuffer answer;
      do {
        call->Read(&answer, nullptr);
        answer.Clear();
      } while (done());
    }
    grpc::Status status;
    call->Finish(&status, nullptr);
    done();
    return lambdajet::FromWire(status);
  }

  // A request with nothing wrong in it, for one field to be spoilt.
  std::unique_ptr<Message> Right(const MethodDescriptor& method, const std::string& path) const {
    const Message* prototype =
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(method.input_type());
    std::unique_ptr<Message> request(prototype->New());
    const Reflection& reflection = *request->GetReflection();
    const auto field = [&](const char* name) { return method.input_type()->FindFieldByName(name); };
    const bool drawing = path.rfind("toolpath", 0) == 0;
    if (const auto* program = field("program")) {
      reflection.SetString(request.get(), program, drawing ? kEmptyDrawing : kPlate);
    } else if (const auto* plan = field("plan_id")) {
      reflection.SetUInt64(request.get(), plan, plan_id_);
    }
    if (method.name() == "Export") {
      static_cast<v1::ExportRequest&>(*request).set_format(v1::ExportRequest::FORMAT_GCODE);
    }
    if (drawing) {
      const auto* format =
          field("format")->enum_type()->name() == "ProgramFormat" ? field("format") : field("program_format");
      reflection.SetEnumValue(request.get(), format, type::v1::PROGRAM_FORMAT_DXF);
    }
    return request;
  }

  std::uint64_t plan_id_ = 0;
};

const google::protobuf::ServiceDescriptor& Service() {
  return *google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
      v1::TrajectoryService::service_full_name());
}

std::vector<Row> RowsOf(const Place& place) {
  static const std::map<std::string, std::vector<Row>> named = NamedRows();
  if (place.field().is_repeated()) {
    std::vector<Row> rows = {RowOfMany(place.path)};
    if (place.name() == "ToolpathSettings.skip_parts") {
      rows.push_back(
          Set<std::uint32_t>("0", &Reflection::AddUInt32, 0u, "OUT_OF_RANGE", "toolpath.skip_parts"));
    }
    return rows;
  }
  if (place.field().cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    return RowsOfDouble(place.path);
  }
  const auto found = named.find(place.name());
  return found == named.end() ? std::vector<Row>() : found->second;
}

std::string AllWords(const absl::Status& status) {
  std::string words(status.message());
  for (const FieldViolation& violation : TroubleViolations(status)) {
    words += " " + violation.field + ": " + violation.description;
  }
  return words;
}

TEST_F(TrajectoryBadInput, IsRefusedFieldByFieldInEveryCall) {
  int rows_tried = 0;
  for (int m = 0; m < Service().method_count(); ++m) {
    const MethodDescriptor& method = *Service().method(m);
    std::vector<Place> places;
    AddPlaces(*method.input_type(), {}, places);
    EXPECT_FALSE(places.empty()) << method.name() << " has nothing to try; say so here if that is right";
    for (const Place& place : places) {
      const std::vector<Row> rows = RowsOf(place);
      EXPECT_NE(rows.empty(), AnyValueIsRight().count(place.name()) == 0)
          << method.name() << ": " << place.name() << " needs rows, or a place in AnyValueIsRight";
      for (const Row& row : rows) {
        SCOPED_TRACE(method.name() + " " + place.path + ", " + row.name);
        const auto request = Right(method, place.path);
        Message& holder = place.Holder(*request);
        if (holder.GetDescriptor()->name() == "ToleranceWish") {
          static_cast<v1::ToleranceWish&>(holder).set_tolerance_mm(0.1);
        }
        row.spoil(holder, place.field());
        const absl::Status status = CallWith(method, request->SerializePartialAsString());
        EXPECT_EQ(status.code(), row.code) << status;
        EXPECT_EQ(TroubleReason(status), row.reason) << status;
        EXPECT_NE(AllWords(status).find(row.says), std::string::npos) << AllWords(status);
        EXPECT_LT(AllWords(status).size(), 16000u);
        ++rows_tried;
      }
    }
  }
  std::printf("%d bad values in %d calls\n", rows_tried, Service().method_count());
  EXPECT_EQ(desk_.List().size(), 1u) << "something bad was planned";
}

TEST_F(TrajectoryBadInput, IsNoMessageAtAllOrComesTooLateInEveryCall) {
  for (int m = 0; m < Service().method_count(); ++m) {
    const MethodDescriptor& method = *Service().method(m);
    SCOPED_TRACE(method.name());
    EXPECT_FALSE(CallWith(method, "\xFF\xFF\xFF\xFF").ok());  // gRPC's own refusal, of its own code
    const std::string right = Right(method, "")->SerializeAsString();
    EXPECT_EQ(CallWith(method, right, -1.0).code(), absl::StatusCode::kDeadlineExceeded);
    EXPECT_TRUE(CallWith(method, right).ok()) << "what is right is answered all the same";
  }
}

TEST_F(TrajectoryBadInput, TheSameWishTwiceIsOnePlan) {
  const auto again = PlanAndWait(kPlate);
  EXPECT_EQ(again.summary().plan_id(), plan_id_);
  EXPECT_EQ(desk_.List().size(), 1u);
}

}  // namespace
}  // namespace lambdajet::trajectory
