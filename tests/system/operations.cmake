# What an operator does with the real processes. Those that move the simulated machine run alone.
foreach(script start_trouble_test prometheus_test tls_test python_client_test disk_full_test cli_live_test)
  if(EXISTS ${CMAKE_CURRENT_LIST_DIR}/${script}.py)
    add_test(NAME system_${script} COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/${script}.py ${CMAKE_BINARY_DIR})
    set_tests_properties(system_${script} PROPERTIES LABELS system TIMEOUT 180
      ENVIRONMENT "LAMBDAJET_PYTHON_STUBS=${CMAKE_BINARY_DIR}/python")
  endif()
endforeach()
set_tests_properties(system_cli_live_test system_disk_full_test PROPERTIES RUN_SERIAL TRUE)
