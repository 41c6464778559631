// Counts, times and logs RPCs: the server's one interceptor.
//
// Model: RED (rate, errors, duration) per method. The metrics of a method are made at its first call and found by its
// name's address after that, so a call costs two clock reads, one lookup and three atomic additions.
// Threads: any.
#pragma once

#include <memory>

namespace grpc::experimental {
class ServerInterceptorFactoryInterface;
}

namespace lambdajet {

class Log;
class Metrics;

// Either may be null.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(Log* log,
                                                                                     Metrics* metrics);

}  // namespace lambdajet
