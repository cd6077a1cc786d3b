function text = underskin_post (address, body, body_type, answer_type)
% UNDERSKIN_POST  Send text to the service and return the answer's text; for MATLAB and GNU Octave.
%   text = underskin_post ('http://127.0.0.1:8000/v1/frf', jsonencode (request), 'application/json', 'application/json')
%   body_type and answer_type are 'application/json' or 'text/csv'. The key, where the service needs one, is read from
%   the environment variable UNDERSKIN_API_KEY. A refusal becomes an error with the service's explanation.

  headers = {'Accept', answer_type};
  if ~isempty (getenv ('UNDERSKIN_API_KEY'))
    headers(end+1,:) = {'Authorization', ['Bearer ' getenv('UNDERSKIN_API_KEY')]};
  end
  if exist ('OCTAVE_VERSION', 'builtin')
    % Octave's webwrite can send neither a body of JSON or CSV nor two headers, so curl does it.
    headers(end+1,:) = {'Content-Type', body_type};
    text = post_by_curl (address, body, headers);
  else
    options = weboptions ('MediaType', body_type, 'ContentType', 'text', 'HeaderFields', headers, 'Timeout', 60);
    text = webwrite (address, body, options);
  end
end

function text = post_by_curl (address, body, headers)
  % Everything but the file names travels in files: no quoting, and the key stays out of the list of processes.
  settings_file = [tempname() '.curl'];
  body_file = [tempname() '.body'];
  remove_files = onCleanup (@() cellfun (@delete, {settings_file, body_file}));
  write_file (body_file, body);
  lines = cellfun (@(name, value) sprintf ('header = "%s: %s"', name, value), headers(:,1), headers(:,2), ...
                   'UniformOutput', false);
  lines = [lines; {'silent'; 'show-error'; 'fail-with-body'; ['url = "' address '"']; ...
                   ['data-binary = "@' strrep(body_file, '\', '/') '"']}];
  write_file (settings_file, strjoin (lines, '\n'));
  [status, text] = system (['curl --config "' settings_file '" 2>&1']);
  if status ~= 0
    error ('underskin: %s', text);
  end
end

function write_file (name, text)
  file = fopen (name, 'w');
  fwrite (file, text);
  fclose (file);
end
