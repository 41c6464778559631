# The echo service of these tests; benchmarks use it too.
add_library(test_echo_proto STATIC ${CMAKE_CURRENT_SOURCE_DIR}/echo.proto)
target_link_libraries(test_echo_proto PUBLIC gRPC::grpc++ protobuf::libprotobuf)
target_include_directories(test_echo_proto SYSTEM PUBLIC ${CMAKE_CURRENT_BINARY_DIR})
protobuf_generate(TARGET test_echo_proto LANGUAGE cpp IMPORT_DIRS ${CMAKE_CURRENT_SOURCE_DIR})
protobuf_generate(TARGET test_echo_proto LANGUAGE grpc IMPORT_DIRS ${CMAKE_CURRENT_SOURCE_DIR}
  GENERATE_EXTENSIONS .grpc.pb.h .grpc.pb.cc PLUGIN protoc-gen-grpc=/usr/bin/grpc_cpp_plugin)

lambdajet_check(platform_rpc_test LABELS rpc SOURCES platform_rpc_test.cpp DEPS platform_rpc test_echo_proto test_support)
lambdajet_check(platform_argument_checks_test LABELS unit SOURCES platform_argument_checks_test.cpp DEPS platform_rpc)
