-- POST a UM-Bridge evaluation with a new a/h each time, over the whole axis.
local count = 0
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
request = function()
  count = count + 1
  local a = 0.01 + (count % 299) * 0.01
  return wrk.format(nil, nil, nil, '{"name":"sigma","input":[[' .. a .. ',0.6,0.01]],"config":{}}')
end
