// Answers InspectionService from what the recorder has kept.
//
// Threads: gRPC's; joining and comparing run on a pool of their own.
// Errors: those of recording/recorder.hpp and drawing_file/drawing_file.hpp; NOT_FOUND NOTHING_RECORDED for a recording
// without truth; INVALID_ARGUMENT for a plan id of 0.
#pragma once

#include "inspection/recording/recorder.hpp"
#include "lambdajet/inspection/v1/inspection.grpc.pb.h"
#include "platform/rpc/work_pool.hpp"

namespace lambdajet::inspection {

class InspectionRpc final : public v1::InspectionService::CallbackService {
 public:
  explicit InspectionRpc(Recorder& recorder);  // outlives this
  ~InspectionRpc() override;

  grpc::ServerUnaryReactor* BeginRecording(grpc::CallbackServerContext* context,
                                           const v1::BeginRecordingRequest* request,
                                           v1::BeginRecordingResponse* response) override;
  grpc::ServerUnaryReactor* EndRecording(grpc::CallbackServerContext* context,
                                         const v1::EndRecordingRequest* request,
                                         v1::EndRecordingResponse* response) override;
  grpc::ServerUnaryReactor* Inspect(grpc::CallbackServerContext* context, const v1::InspectRequest* request,
                                    v1::InspectResponse* response) override;
  grpc::ServerWriteReactor<v1::CutPathBatch>* StreamCutPath(grpc::CallbackServerContext* context,
                                                            const v1::StreamCutPathRequest* request) override;

 private:
  Recorder& recorder_;
  WorkPool pool_;
};

}  // namespace lambdajet::inspection
