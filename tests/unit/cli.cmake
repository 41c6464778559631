if(TARGET cli_frame)
  lambdajet_check(cli_frame_test LABELS unit SOURCES cli_frame_test.cpp DEPS cli_frame)
endif()
