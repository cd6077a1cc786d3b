-- POST a Tesseract evaluation with a new a/h each time, over the whole axis.
local count = 0
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
request = function()
  count = count + 1
  local a = 0.01 + (count % 299) * 0.01
  return wrk.format(nil, nil, nil, '{"inputs":{"a_over_h":' .. a .. ',"rt_over_h":0.6,"load_parameter":0.01}}')
end
